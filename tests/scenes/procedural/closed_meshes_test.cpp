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

TEST(Spikes, IsOneConnectedMesh) {
    const DeformingMesh mesh = make_spikes(5000);
    std::vector<std::uint32_t> parent(mesh.topology.vertex_count);
    for (std::uint32_t i = 0; i < parent.size(); ++i) parent[i] = i;
    const auto root = [&](std::uint32_t i) {
        while (parent[i] != i) i = parent[i] = parent[parent[i]];
        return i;
    };
    for (const uvec3& t : mesh.topology.triangles) {
        parent[root(t.x)] = root(t.y);
        parent[root(t.y)] = root(t.z);
    }
    for (std::uint32_t i = 0; i < parent.size(); ++i) ASSERT_EQ(root(i), root(0));
}

TEST(Spikes, HasNoVertexTwice) {
    const auto clip = make_procedural("spikes", 60000);
    for (const double frame : {0.0, 2.5, 24.0}) {
        std::set<std::tuple<float, float, float>> seen;
        for (const vec3& p : positions_of(*clip, frame)) {
            EXPECT_TRUE(seen.emplace(p.x, p.y, p.z).second);
        }
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

TEST(Spikes, RisesAndFallsByMoreThanHalfOfItsRadius) {
    const auto clip = make_procedural("spikes", 20000);
    std::vector<float> least(clip->topology().vertex_count, 1e9f);
    std::vector<float> most(least.size(), 0.0f);
    for (int frame = 0; frame <= 24; ++frame) {
        const std::vector<vec3> positions = positions_of(*clip, frame);
        for (std::size_t i = 0; i < positions.size(); ++i) {
            const vec3 p = positions[i];
            const float radius = std::sqrt(p.x * p.x + p.y * p.y + p.z * p.z);
            least[i] = std::min(least[i], radius);
            most[i] = std::max(most[i], radius);
        }
    }
    float pulse = 0;
    for (std::size_t i = 0; i < least.size(); ++i) pulse = std::max(pulse, most[i] - least[i]);
    EXPECT_GT(pulse, 0.5f);
    EXPECT_GT(*std::min_element(least.begin(), least.end()), 0.99f);
}

}  // namespace
}  // namespace mray
