// The scenes that claim to be closed meshes.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <tuple>
#include <vector>

#include "scenes/procedural/procedural.h"
#include "scenes/procedural/scenes.h"
#include "tests/scenes/procedural/mesh_checks.h"

namespace mray {
namespace {

TEST(ClosedMeshes, SpikesShareEachEdgeBetweenTwoOppositeTriangles) {
    for (const std::uint64_t request : {1, 10, 123, 5000, 40000}) {
        EXPECT_EQ(open_edges(make_spikes(request).topology.triangles), 0u) << request;
    }
}

TEST(ClosedMeshes, BoxesAndAnimalsShareEachEdgeBetweenTwoOppositeTriangles) {
    for (const std::uint64_t request : {1, 100, 5000, 40000}) {
        EXPECT_EQ(open_edges(make_twist(request).topology.triangles), 0u) << request;
        const DeformingMesh herd = make_herd(request);
        const auto animals = std::span(herd.topology.triangles).subspan(herd.static_triangle_count);
        EXPECT_EQ(open_edges(animals), 0u) << request;
    }
}

TEST(ClosedMeshes, FaceOutwards) {
    for (const char* name : {"spikes", "twist", "shuffle"}) {
        const auto clip = make_procedural(name, 3000);
        for (const double frame : {0.0, 4.0, 12.0, 20.3}) {
            EXPECT_GT(mesh_volume6(clip->topology().triangles, positions_of(*clip, frame)), 0)
                << name << ' ' << frame;
        }
    }
    const DeformingMesh herd = make_herd(3000);
    std::vector<vec3> positions(herd.topology.vertex_count);
    herd.move(5, {0, herd.topology.vertex_count}, positions);
    const auto animals = std::span(herd.topology.triangles).subspan(herd.static_triangle_count);
    EXPECT_GT(mesh_volume6(animals, positions), 0);
}

TEST(ClosedMeshes, ClothAndHerdHaveGroundThatFacesUp) {
    for (const DeformingMesh& mesh : {make_cloth(3000), make_herd(3000)}) {
        std::vector<vec3> positions(mesh.topology.vertex_count);
        mesh.move(0, {0, mesh.topology.vertex_count}, positions);
        const uvec3 t = mesh.topology.triangles[0];
        const vec3 a = positions[t.x];
        const vec3 b = positions[t.y];
        const vec3 c = positions[t.z];
        EXPECT_GT((b.z - a.z) * (c.x - a.x) - (b.x - a.x) * (c.z - a.z), 0);
    }
}

TEST(Spikes, IsStarShapedAroundTheOrigin) {
    for (const std::uint64_t request : {1, 200, 20000, 200000}) {
        const auto clip = make_procedural("spikes", request);
        for (const double frame : {0.0, 1.0, 3.7, 11.0, 24.0}) {
            const std::vector<vec3> positions = positions_of(*clip, frame);
            for (const uvec3& t : clip->topology().triangles) {
                ASSERT_GT(volume6(positions[t.x], positions[t.y], positions[t.z]), 0)
                    << request << ' ' << frame;
            }
        }
    }
}

}  // namespace
}  // namespace mray
