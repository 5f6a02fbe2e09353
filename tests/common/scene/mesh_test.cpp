#include "common/scene/mesh.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "common/interop/constants.h"
#include "common/interop/surface.h"
#include "common/scene/vertex_normals.h"
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

const std::vector<vec3> kRoof = {{-1, 0, 0}, {-1, 0, 2}, {0, 1, 0},
                                 {0, 1, 2},  {1, 0, 0},  {1, 0, 2}};
const std::vector<uvec3> kRoofTriangles = {{0, 1, 2}, {2, 1, 3}, {2, 3, 4}, {4, 3, 5}};

void expect_near(vec3 actual, vec3 expected) {
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(actual[k], expected[k], 1e-6) << k;
}

TEST(VertexNormals, AreTheMeanOfTheirTrianglesByAngle) {
    VertexNormals normals(kRoofTriangles, kRoofTriangles);
    normals.update(kRoof);
    ASSERT_EQ(normals.normals().size(), 6u);
    const float s = std::sqrt(0.5f);
    expect_near(normals.normals()[0], {-s, s, 0});
    expect_near(normals.normals()[4], {s, s, 0});
    // Vertex 2 has two triangles on the left and one on the right side, and a right angle on both.
    expect_near(normals.normals()[2], {0, 1, 0});
    expect_near(normals.normals()[3], {0, 1, 0});
    // A corner of 30 degrees beside one of 135, which lies in the plane x = 0.
    const std::vector<vec3> fan = {{0, 0, 0}, {0, 1, 0}, {1, std::sqrt(3.0f), 0}, {0, -1, 1}};
    const std::vector<uvec3> triangles = {{0, 2, 1}, {0, 1, 3}};
    VertexNormals at(triangles, triangles);
    at.update(fan);
    expect_near(at.normals()[0], unit(vec3(135, 0, 30)));
}

TEST(VertexNormals, FollowTheNumbersNotTheVertices) {
    // Both sides of the ridge are numbered apart.
    const std::vector<uvec3> ids = {{0, 1, 2}, {2, 1, 3}, {4, 5, 6}, {6, 5, 7}};
    VertexNormals normals(kRoofTriangles, ids);
    normals.update(kRoof);
    const float s = std::sqrt(0.5f);
    for (const std::size_t i : {0u, 1u, 2u, 3u}) expect_near(normals.normals()[i], {-s, s, 0});
    for (const std::size_t i : {4u, 5u, 6u, 7u}) expect_near(normals.normals()[i], {s, s, 0});
}

TEST(VertexNormals, FollowTheDeformation) {
    VertexNormals normals(kRoofTriangles, kRoofTriangles);
    normals.update(kRoof);
    std::vector<vec3> flat = kRoof;
    for (vec3& p : flat) p.y = 0;
    normals.update(flat);
    for (const vec3& n : normals.normals()) expect_near(n, {0, 1, 0});
}

TEST(VertexNormals, AreZeroWithoutAnArea) {
    const std::vector<uvec3> triangles = {{0, 1, 2}, {0, 1, 3}};
    std::vector<vec3> positions = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, vec3(kInvalidCoordinate)};
    VertexNormals normals(triangles, triangles);
    normals.update(positions);
    for (const vec3& n : normals.normals()) EXPECT_EQ(n, vec3(0, 0, 0));
}

TEST(VertexNormals, LeaveOutFlatCorners) {
    const std::vector<uvec3> triangles = {{0, 1, 2}};
    VertexNormals none(triangles, std::vector{uvec3(kFlatCorner)});
    none.update(kRoof);
    EXPECT_EQ(none.normals().size(), 1u);
    VertexNormals some(triangles, std::vector{uvec3(0, kFlatCorner, 1)});
    some.update(kRoof);
    ASSERT_EQ(some.normals().size(), 2u);
    const float s = std::sqrt(0.5f);
    for (const vec3& n : some.normals()) expect_near(n, {-s, s, 0});
    VertexNormals empty({}, {});
    empty.update({});
    EXPECT_EQ(empty.normals().size(), 1u);
}

}  // namespace
}  // namespace mray
