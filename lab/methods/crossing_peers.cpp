#include "lab/methods/crossing_peers.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/orient_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Surface_mesh.h>
#include <fcl/fcl.h>

#include <limits>
#include <memory>

namespace mray::lab {
namespace {

using Point = CGAL::Exact_predicates_inexact_constructions_kernel::Point_3;
using Mesh = CGAL::Surface_mesh<Point>;
using Model = fcl::BVHModel<fcl::AABBf>;

/// Vertices of a Surface_mesh that is made from a soup keep their order.
std::size_t count_by_cgal(Mesh& mesh, std::span<const vec3> positions) {
    for (const Mesh::Vertex_index v : mesh.vertices()) {
        const vec3& p = positions[v.idx()];
        mesh.point(v) = Point(p.x, p.y, p.z);
    }
    std::vector<std::pair<Mesh::Face_index, Mesh::Face_index>> pairs;
    CGAL::Polygon_mesh_processing::self_intersections(mesh, std::back_inserter(pairs));
    return pairs.size();
}

std::vector<fcl::Vector3f> fcl_points(std::span<const vec3> positions) {
    std::vector<fcl::Vector3f> points;
    for (const vec3& p : positions) points.emplace_back(p.x, p.y, p.z);
    return points;
}

std::size_t count_by_fcl(Model& model, std::span<const vec3> positions) {
    model.beginUpdateModel();
    model.updateSubModel(fcl_points(positions));
    model.endUpdateModel(true, true);
    const fcl::CollisionRequestf all(std::numeric_limits<int>::max(), false);
    fcl::CollisionResultf result;
    const auto identity = fcl::Transform3f::Identity();
    fcl::collide(&model, identity, &model, identity, all, result);
    return result.numContacts();
}

}  // namespace

std::vector<CrossingPeer> crossing_peers(const Topology& topology,
                                         std::span<const vec3> positions) {
    namespace pmp = CGAL::Polygon_mesh_processing;
    std::vector<CrossingPeer> peers;
    std::vector<std::vector<std::size_t>> polygons;
    std::vector<fcl::Triangle> triangles;
    for (const uvec3& t : topology.triangles) {
        polygons.push_back({t.x, t.y, t.z});
        triangles.emplace_back(t.x, t.y, t.z);
    }
    if (pmp::is_polygon_soup_a_polygon_mesh(polygons)) {
        const auto mesh = std::make_shared<Mesh>();
        pmp::polygon_soup_to_polygon_mesh(std::vector<Point>(positions.size()), polygons, *mesh);
        peers.push_back({"CGAL", true, [mesh](auto moved) { return count_by_cgal(*mesh, moved); }});
    }
    const auto model = std::make_shared<Model>();
    model->beginModel();
    model->addSubModel(fcl_points(positions), triangles);
    model->endModel();
    peers.push_back({"FCL", false, [model](auto moved) { return count_by_fcl(*model, moved); }});
    return peers;
}

}  // namespace mray::lab
