#include "common/scene/vertex_normals.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "common/interop/constants.h"
#include "common/interop/surface.h"

namespace mray {
namespace {

const std::vector<vec3> kRoof = {{-1, 0, 0}, {-1, 0, 2}, {0, 1, 0},
                                 {0, 1, 2},  {1, 0, 0},  {1, 0, 2}};
const std::vector<uvec3> kRoofTriangles = {{0, 1, 2}, {2, 1, 3}, {2, 3, 4}, {4, 3, 5}};

void expect_near(vec3 actual, vec3 expected) {
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(actual[k], expected[k], 1e-6) << k;
}

TEST(VertexNormals, AreTheMeanOfTheirTriangles) {
    VertexNormals normals(kRoofTriangles, kRoofTriangles);
    normals.update(kRoof);
    ASSERT_EQ(normals.normals().size(), 6u);
    const float s = std::sqrt(0.5f);
    expect_near(normals.normals()[0], {-s, s, 0});
    expect_near(normals.normals()[4], {s, s, 0});
    // Vertex 2 has two triangles on the right and two on the left side: its mean points up.
    const vec3 ridge = unit(vec3(-s, s, 0) * 2.0f + vec3(s, s, 0));
    expect_near(normals.normals()[2], ridge);
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
