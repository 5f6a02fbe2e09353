#include "scenes/polygons/triangulate.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <random>

namespace mray {
namespace {

Polygons one_face(std::size_t corners) {
    Polygons faces;
    faces.corners.resize(corners);
    std::iota(faces.corners.begin(), faces.corners.end(), 0u);
    faces.corner_counts = {static_cast<std::uint32_t>(corners)};
    return faces;
}

std::vector<uvec3> triangles_of(const std::vector<vec3>& positions) {
    return triangulate(one_face(positions.size()), positions);
}

glm::dvec3 area_vector(const vec3& a, const vec3& b, const vec3& c) {
    const glm::dvec3 u = glm::dvec3(b) - glm::dvec3(a);
    const glm::dvec3 v = glm::dvec3(c) - glm::dvec3(a);
    return {u.y * v.z - u.z * v.y, u.z * v.x - u.x * v.z, u.x * v.y - u.y * v.x};
}

double length(const glm::dvec3& v) { return std::sqrt(v.x * v.x + v.y * v.y + v.z * v.z); }
double dot(const glm::dvec3& a, const glm::dvec3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

// Triangles of a flat simple polygon cover it once if there are n - 2, none is wound against the
// polygon, and their areas add up to its area.
void expect_covers(const std::vector<vec3>& positions, const std::string& what) {
    const std::vector<uvec3> triangles = triangles_of(positions);
    ASSERT_EQ(triangles.size(), positions.size() - 2) << what;
    glm::dvec3 polygon(0.0);
    for (std::size_t i = 1; i + 1 < positions.size(); ++i) {
        polygon += area_vector(positions[0], positions[i], positions[i + 1]);
    }
    double sum = 0;
    for (const uvec3& t : triangles) {
        const glm::dvec3 area = area_vector(positions[t.x], positions[t.y], positions[t.z]);
        EXPECT_GE(dot(area, polygon), -1e-12 * dot(polygon, polygon)) << what;
        sum += length(area);
    }
    EXPECT_NEAR(sum, length(polygon), 1e-6 * length(polygon)) << what;
}

TEST(Triangulate, ConvexFaceIsAFanFromItsFirstCorner) {
    EXPECT_EQ(triangles_of({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}),
              (std::vector<uvec3>{{0, 1, 2}, {0, 2, 3}}));
}

TEST(Triangulate, ConcaveQuadIsRightWhereverItsNotchIs) {
    const std::vector<vec3> arrow = {{0, 0, 0}, {4, 0, 0}, {1, 1, 0}, {0, 4, 0}};
    for (int shift = 0; shift < 4; ++shift) {
        for (const bool mirrored : {false, true}) {
            std::vector<vec3> quad = arrow;
            std::rotate(quad.begin(), quad.begin() + shift, quad.end());
            if (mirrored) std::reverse(quad.begin(), quad.end());
            expect_covers(quad, fmt::format("shift {}", shift));
            for (vec3& p : quad) p = {p.y, p.x + 2 * p.y, p.x};  // out of the plane z = 0
            expect_covers(quad, fmt::format("tilted, shift {}", shift));
        }
    }
}

TEST(Triangulate, RandomConcavePolygonsAreCoveredOnce) {
    std::mt19937 random(11);
    std::uniform_real_distribution<double> radius(0.1, 1);
    for (int round = 0; round < 300; ++round) {
        const int count = 4 + round;
        std::vector<vec3> star;
        for (int i = 0; i < count; ++i) {
            const double angle = 2 * std::numbers::pi * i / count;
            const double r = radius(random);
            star.emplace_back(static_cast<float>(r * std::cos(angle)),
                              static_cast<float>(r * std::sin(angle)), 0.25f);
        }
        if (round % 2 == 1) std::reverse(star.begin(), star.end());
        expect_covers(star, fmt::format("round {}", round));
    }
}

TEST(Triangulate, CombSpiralAndHoleAreCoveredOnce) {
    std::vector<vec3> comb;
    for (int i = 0; i < 101; ++i) comb.emplace_back(i, i % 2 * 50, 0);
    comb.emplace_back(100, -1, 0);
    comb.emplace_back(0, -1, 0);
    expect_covers(comb, "comb");

    std::vector<vec3> spiral;
    for (int side = 0; side < 2; ++side) {
        for (int k = 0; k < 400; ++k) {
            const int i = side == 0 ? k : 399 - k;
            const double r = 1 + 0.01 * i + 0.2 * side;
            spiral.emplace_back(static_cast<float>(r * std::cos(0.1 * i)),
                                static_cast<float>(r * std::sin(0.1 * i)), 0);
        }
    }
    expect_covers(spiral, "spiral");

    // A square with a square hole, joined by a bridge that is walked twice.
    expect_covers({{0, 0, 0},
                   {3, 0, 0},
                   {3, 3, 0},
                   {0, 3, 0},
                   {0, 0, 0},
                   {1, 1, 0},
                   {1, 2, 0},
                   {2, 2, 0},
                   {2, 1, 0},
                   {1, 1, 0}},
                  "hole");
}

TEST(Triangulate, FacesWithoutAnAnswerStillGetTheirNumberOfTriangles) {
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const float inf = std::numeric_limits<float>::infinity();
    const std::vector<std::vector<vec3>> faces = {
        std::vector<vec3>(7, vec3(1, 2, 3)),
        {{0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {3, 3, 3}, {1, 1, 1}},
        {{0, 0, 0}, {nan, 0, 0}, {1, 1, 0}, {0, 1, 0}},
        {{0, 0, 0}, {1, 0, 0}, {1, inf, 0}, {0, 1, 0}},
        {{3e38f, 3e38f, 0}, {-3e38f, 3e38f, 0}, {3e37f, -3e37f, 0}, {3e38f, -3e38f, 0}},
        {{0, 0, 0}, {1, 1, 0}, {1, 0, 0}, {0, 1, 0}},                 // bow tie
        {{0, 3, 0}, {2, -3, 0}, {-3, 1, 0}, {3, 1, 0}, {-2, -3, 0}},  // pentagram
        {{0, 0, 0}, {1e-42f, 0, 0}, {1e-43f, 1e-43f, 0}, {0, 1e-42f, 0}},
    };
    for (const std::vector<vec3>& face : faces) {
        const std::vector<uvec3> triangles = triangles_of(face);
        ASSERT_EQ(triangles.size(), face.size() - 2);
        for (const uvec3& t : triangles) {
            EXPECT_LT(std::max({t.x, t.y, t.z}), face.size());
            EXPECT_TRUE(t.x != t.y && t.y != t.z && t.z != t.x);
        }
    }
}

std::vector<vec3> ring(int count, double outer) {
    std::vector<vec3> points;
    for (int i = 0; i < count; ++i) {
        const double angle = 2 * std::numbers::pi * i / count;
        const double r = i % 2 == 0 ? 1 : outer;
        points.emplace_back(static_cast<float>(r * std::cos(angle)),
                            static_cast<float>(r * std::sin(angle)), 0);
    }
    return points;
}

TEST(Triangulate, ThousandsOfCornersAreCovered) {
    constexpr int kCount = 4000;
    EXPECT_EQ(triangles_of(ring(kCount, 1)).size(), kCount - 2u);
    expect_covers(ring(kCount, 2), "star");
    std::vector<vec3> comb;
    for (int i = 0; i < kCount; ++i) comb.emplace_back(i, i % 2 * 1000, 0);
    EXPECT_EQ(triangles_of(comb).size(), kCount - 2u);
}

// A comb whose long teeth lean over: the box of each tooth holds the feet of all teeth after it.
std::vector<vec3> leaning_comb(int teeth) {
    std::vector<vec3> points;
    const int length = 2 * teeth;
    for (int i = 0; i < teeth; ++i) {
        points.emplace_back(2 * i, 0, 0);
        points.emplace_back(2 * i + 1 + length, length, 0);
    }
    points.emplace_back(2 * teeth, 0, 0);
    points.emplace_back(2 * teeth, -1, 0);
    points.emplace_back(0, -1, 0);
    for (vec3& p : points) p.x = -p.x;  // counter-clockwise
    return points;
}

TEST(Triangulate, LeaningTeethAreCovered) { expect_covers(leaning_comb(300), "300 teeth"); }

TEST(Triangulate, CrossingEdgesOfThousandsOfCornersEnd) {
    std::mt19937 random(3);
    std::uniform_real_distribution<float> coordinate(0, 1);
    std::vector<vec3> tangle(5'000);
    for (vec3& p : tangle) p = {coordinate(random), coordinate(random), 0};
    EXPECT_EQ(triangles_of(tangle).size(), tangle.size() - 2);
}

}  // namespace
}  // namespace mray
