#include "lab/bench/cgal_tree.h"

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Simple_cartesian.h>
#include <CGAL/version.h>
#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <cmath>
#include <cstddef>
#include <memory>
#include <vector>

#include "common/bvh/box.h"

namespace mray::lab {
namespace {

using Kernel = CGAL::Simple_cartesian<double>;
using Triangles = std::vector<Kernel::Triangle_3>;
using Primitive = CGAL::AABB_triangle_primitive<Kernel, Triangles::const_iterator>;
using Tree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>>;

Kernel::Point_3 to_cgal(vec3 p) { return {p.x, p.y, p.z}; }

class CgalTree {
public:
    explicit CgalTree(const BenchScene& scene) {
        const std::vector<uvec3>& triangles = scene.topology().triangles;
        for (std::size_t i = 0; i < triangles.size(); ++i) {
            const vec3 a = scene.positions[triangles[i].x];
            const vec3 b = scene.positions[triangles[i].y];
            const vec3 c = scene.positions[triangles[i].z];
            if (!is_finite_vertex(a) || !is_finite_vertex(b) || !is_finite_vertex(c)) continue;
            triangles_.emplace_back(to_cgal(a), to_cgal(b), to_cgal(c));
            prim_ids_.push_back(static_cast<std::uint32_t>(i));
        }
        tree_.insert(triangles_.cbegin(), triangles_.cend());
        tree_.build();
        tree_.accelerate_distance_queries();
    }

    void find_closest(std::span<const vec3> points, std::span<NearestPoint> nearest) const {
        using Range = tbb::blocked_range<std::size_t>;
        tbb::parallel_for(Range(0, points.size(), 1024), [&](const Range& range) {
            for (std::size_t i = range.begin(); i < range.end(); ++i) {
                const Kernel::Point_3 p = to_cgal(points[i]);
                const auto [point, triangle] = tree_.closest_point_and_primitive(p);
                nearest[i] = {vec3(point.x(), point.y(), point.z()),
                              static_cast<float>(std::sqrt(CGAL::squared_distance(p, point))),
                              prim_ids_[static_cast<std::size_t>(triangle - triangles_.cbegin())]};
            }
        });
    }
    bool empty() const { return triangles_.empty(); }

private:
    Triangles triangles_;
    std::vector<std::uint32_t> prim_ids_;
    Tree tree_;
};

}  // namespace

CgalPeer make_cgal_peer(const BenchScene& scene) {
    const auto tree = std::make_shared<const CgalTree>(scene);
    if (tree->empty()) return {};
    return {fmt::format("CGAL {} AABB_tree", CGAL_VERSION_STR),
            [tree](std::span<const vec3> points, std::span<NearestPoint> nearest) {
                tree->find_closest(points, nearest);
            }};
}

}  // namespace mray::lab
