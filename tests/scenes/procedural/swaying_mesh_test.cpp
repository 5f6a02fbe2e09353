// Parts of scenes that sway, and the scenes that are made of them.
#include "scenes/procedural/parts/swaying_mesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "scenes/procedural/procedural.h"
#include "scenes/procedural/scenes.h"
#include "tests/scenes/procedural/mesh_checks.h"

namespace mray {
namespace {

std::vector<vec3> positions_at(const DeformingMesh& mesh, double frame) {
    std::vector<vec3> positions(mesh.topology.vertex_count);
    mesh.move(frame, {0, mesh.topology.vertex_count}, positions);
    return positions;
}

double volume_of(const DeformingMesh& mesh) {
    return static_cast<double>(mesh_volume6(mesh.topology.triangles, positions_at(mesh, 0)) / 6);
}

TEST(SwayingMesh, MakesClosedPartsThatFaceOutwardsAndRoomsThatFaceInwards) {
    SwayingMesh box;
    box.add_box({1, 2, 3}, {2, 4, 6}, 1);
    SwayingMesh room;
    room.add_room({1, 2, 3}, {2, 4, 6}, 1);
    SwayingMesh tube;
    tube.add_tube({{0, 0, 0}, {1, 2, -1}, 0.5, 0.75, 7, 4}, 1);
    SwayingMesh sphere;
    sphere.add_sphere({5, 0, 0}, 1, 4000, 1);
    EXPECT_EQ(tube.triangle_count(), TubeShape::triangle_count(7, 4));
    for (SwayingMesh* part : {&box, &room, &tube, &sphere}) {
        const DeformingMesh mesh = std::move(*part).finish();
        EXPECT_EQ(open_edges(mesh.topology.triangles), 0u);
        EXPECT_EQ(mesh.static_triangle_count, mesh.topology.triangles.size());
        const double expected = part == &box      ? 6
                                : part == &room   ? -6
                                : part == &sphere ? 4.18879
                                                  : 0;
        if (expected != 0) {
            EXPECT_NEAR(volume_of(mesh), expected, 0.02);
        } else {
            EXPECT_GT(volume_of(mesh), 1);
        }
    }
}

TEST(SwayingMesh, CountsAsStaticWhatLiesBeforeTheFirstMovingTriangle) {
    SwayingMesh mesh;
    mesh.add_box({0, 0, 0}, {1, 1, 1}, 1);
    mesh.add_sheet(2, 3, 2, [](double s, double t) -> SwayingVertex {
        return {{s, 2 - t, 0}, {0, 0, 0.5 * t}, 0};
    });
    const DeformingMesh made = std::move(mesh).finish();
    // The upper row of the sheet has vertices that hang and vertices that are held.
    EXPECT_EQ(made.static_triangle_count, 12u);
    const std::vector<vec3> before = positions_at(made, 0);
    const std::vector<vec3> after = positions_at(made, 3);
    EXPECT_EQ(before[8], after[8]);
    EXPECT_NEAR(after.back().z, 0.5, 1e-6);
}

TEST(Interiors, AreClosedRoundTheEyesThatLookAtThem) {
    for (const DeformingMesh& mesh : {make_hall(5000), make_room(5000)}) {
        // The first twelve triangles are the walls.
        const auto walls = std::span(mesh.topology.triangles).first(12);
        EXPECT_EQ(open_edges(walls), 0u);
        const std::vector<vec3> positions = positions_at(mesh, 4);
        EXPECT_LT(mesh_volume6(walls, positions), 0);
        vec3 lower = positions[0];
        vec3 upper = positions[0];
        for (const vec3& p : std::span(positions).first(8)) {
            lower = glm::min(lower, p);
            upper = glm::max(upper, p);
        }
        for (const vec3& p : positions) {
            EXPECT_EQ(glm::min(lower, p), lower);
            EXPECT_EQ(glm::max(upper, p), upper);
        }
    }
}

TEST(Hair, IsOfThinStrips) {
    const DeformingMesh mesh = make_hair(20000);
    const std::vector<vec3> positions = positions_at(mesh, 0);
    std::size_t thin = 0;
    for (const uvec3& t : mesh.topology.triangles) {
        const vec3 a = positions[t.y] - positions[t.x];
        const vec3 b = positions[t.z] - positions[t.x];
        const double longest = std::max({glm::length(a), glm::length(b), glm::length(a - b)});
        const double height = glm::length(glm::cross(a, b)) / longest;
        thin += height < longest / 10;
    }
    EXPECT_GT(thin, mesh.topology.triangles.size() * 9 / 10);
}

TEST(Degenerate, HasNoAreaInHalfOfItsTriangles) {
    const auto clip = make_procedural("degenerate", 4000);
    for (const double frame : {0.0, 5.5, 24.0}) {
        const std::vector<vec3> positions = positions_of(*clip, frame);
        std::size_t empty = 0;
        for (const uvec3& t : clip->topology().triangles) {
            const vec3& a = positions[t.x];
            const vec3& b = positions[t.y];
            const vec3& c = positions[t.z];
            empty += a == b || b == c || c == a;
        }
        const double share =
            static_cast<double>(empty) / static_cast<double>(clip->topology().triangles.size());
        EXPECT_NEAR(share, 0.5, 0.03);
    }
}

}  // namespace
}  // namespace mray
