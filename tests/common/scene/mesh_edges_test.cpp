#include "common/scene/mesh.h"

#include <gtest/gtest.h>

#include <vector>

#include "tests/support/test_scene.h"

namespace mray {
namespace {

EdgeCounts counts_of(const std::vector<vec3>& positions, const std::vector<uvec3>& triangles) {
    const test::TestScene scene(positions, triangles);
    return count_edges(scene.topology(), scene.positions());
}

void expect_counts(const EdgeCounts& counts, std::uint64_t open, std::uint64_t shared,
                   std::uint64_t turned, std::uint64_t uneven) {
    EXPECT_EQ(counts.open, open);
    EXPECT_EQ(counts.shared, shared);
    EXPECT_EQ(counts.turned, turned);
    EXPECT_EQ(counts.uneven, uneven);
}

const std::vector<vec3> kCorners = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
const std::vector<uvec3> kTetrahedron = test::shapes::tetrahedron().triangles;

TEST(MeshEdges, AreOpenOrTurnedWhereATriangleIsMissingOrTurned) {
    std::vector<uvec3> triangles = kTetrahedron;
    expect_counts(counts_of(kCorners, triangles), 0, 0, 0, 0);
    std::swap(triangles.back().y, triangles.back().z);
    expect_counts(counts_of(kCorners, triangles), 0, 0, 3, 3);
    triangles.pop_back();
    expect_counts(counts_of(kCorners, triangles), 3, 0, 0, 3);
}

TEST(MeshEdges, SharedEdgesMayBeEven) {
    // Two tetrahedra at edge 0 - 1; then a fin at it.
    std::vector<vec3> corners = kCorners;
    corners.insert(corners.end(), {{0, -1, 0}, {0, 0, -1}});
    std::vector<uvec3> triangles = kTetrahedron;
    triangles.insert(triangles.end(), {{0, 4, 1}, {0, 5, 4}, {0, 1, 5}, {1, 4, 5}});
    expect_counts(counts_of(corners, triangles), 0, 1, 0, 0);
    triangles.push_back({0, 1, 5});
    expect_counts(counts_of(corners, triangles), 0, 3, 0, 3);
}

TEST(MeshEdges, TwinsHaveTheOppositeDirection) {
    std::vector<uvec3> triangles = kTetrahedron;
    for (const uvec3& t : kTetrahedron) triangles.push_back({t.y, t.z, t.x});
    expect_counts(counts_of(kCorners, triangles), 0, 6, 0, 0);
    EXPECT_EQ(counts_of(kCorners, triangles).twins, 0u);
    triangles.push_back({1, 2, 0});
    EXPECT_EQ(counts_of(kCorners, triangles).twins, 3u);
    triangles = kTetrahedron;
    for (const uvec3& t : kTetrahedron) triangles.push_back({t.y, t.x, t.z});
    expect_counts(counts_of(kCorners, triangles), 0, 6, 0, 0);
    EXPECT_EQ(counts_of(kCorners, triangles).twins, 8u);
}

TEST(MeshEdges, VerticesAtOnePlaceAreOne) {
    std::vector<vec3> corners;
    std::vector<uvec3> triangles;
    for (const uvec3& t : kTetrahedron) {
        triangles.push_back(uvec3(0, 1, 2) + static_cast<std::uint32_t>(corners.size()));
        corners.insert(corners.end(), {kCorners[t.x], kCorners[t.y], kCorners[t.z]});
    }
    corners[0].x = -0.0f;
    expect_counts(counts_of(corners, triangles), 0, 0, 0, 0);
}

TEST(MeshEdges, TrianglesWithoutThreePlacesDoNotCount) {
    std::vector<vec3> corners = kCorners;
    corners.insert(corners.end(), {{0, 1, 0}, {NAN, 0, 0}});
    std::vector<uvec3> triangles = kTetrahedron;
    triangles.insert(triangles.end(), {{2, 4, 1}, {0, 1, 5}, {3, 3, 0}});
    expect_counts(counts_of(corners, triangles), 0, 0, 0, 0);
    expect_counts(counts_of({}, {}), 0, 0, 0, 0);
}

}  // namespace
}  // namespace mray
