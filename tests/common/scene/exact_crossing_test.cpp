#include "common/scene/exact_crossing.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>

#include "tests/support/test_scene.h"

namespace mray::test {
namespace {

/// A corner as seen from a point that is moved by (e, e^2, e^3) with e = 2^-5, in units of 2^-15.
struct MovedCorner {
    std::int64_t x, y, z;

    MovedCorner(vec3 p, vec3 corner)
        : x(scaled(corner.x - p.x) - 1024),
          y(scaled(corner.y - p.y) - 32),
          z(scaled(corner.z - p.z) - 1) {}
    static std::int64_t scaled(float x) { return static_cast<std::int64_t>(x) * 32768; }
    /// The edge function seen along z.
    std::int64_t edge(const MovedCorner& to) const { return x * to.y - y * to.x; }
};

/// The crossing of a half-line that goes through no edge, and does not begin on the triangle.
int moved_crossing(vec3 p, vec3 a, vec3 b, vec3 c) {
    const MovedCorner ra(p, a);
    const MovedCorner rb(p, b);
    const MovedCorner rc(p, c);
    const std::int64_t u = rb.edge(rc);
    const std::int64_t v = rc.edge(ra);
    const std::int64_t w = ra.edge(rb);
    const std::int64_t height = u * ra.z + v * rb.z + w * rc.z;
    if (u > 0 && v > 0 && w > 0 && height > 0) return 1;
    return u < 0 && v < 0 && w < 0 && height < 0 ? -1 : 0;
}

TEST(ExactCrossing, IsThatOfAPointThatIsMovedALittle) {
    // Coordinates of -1, 0 and 1: 2^-5 is less than any ratio of their determinants.
    const auto at = [](int i) { return vec3(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1); };
    std::size_t wrong = 0;
    std::size_t crossed = 0;
    for (int a = 0; a < 27; ++a) {
        for (int b = 0; b < 27; ++b) {
            // The order of the corners turns the sign alone.
            for (int c = a; c < 27; ++c) {
                for (int p = 0; p < 27; ++p) {
                    const int expected = moved_crossing(at(p), at(a), at(b), at(c));
                    wrong += exact_crossing(at(p), at(a), at(b), at(c)).sign != expected;
                    crossed += expected != 0;
                }
            }
        }
    }
    EXPECT_EQ(wrong, 0u);
    EXPECT_GT(crossed, 1000u);
}

TEST(ExactCrossing, TakesDenormalsBesideOtherNumbers) {
    // In the middle of an edge from 0 to a point of which one coordinate is a denormal, at last.
    const vec3 a(0, 0, 0);
    const vec3 b(0x1p-125f, 0x1p-126f, 0);
    const vec3 c(0, 1, 0);
    EXPECT_TRUE(exact_crossing({0x1p-126f, 0x1p-127f, 0}, a, b, c).is_on_triangle);
    EXPECT_FALSE(exact_crossing({0x1p-126f, 0x1.fffff8p-128f, 0}, a, b, c).is_on_triangle);
}

TEST(ExactCrossing, TakesCoordinatesOfAllSizes) {
    const float tiny = std::numeric_limits<float>::denorm_min();
    const float huge = std::numeric_limits<float>::max();
    const std::vector<vec3> far = {{-huge, -huge, tiny}, {huge, -huge, tiny}, {0, huge, tiny}};
    const auto at = [&](float z) { return exact_crossing({0, 0, z}, far[0], far[1], far[2]); };
    EXPECT_EQ(at(0).sign, 1);
    EXPECT_EQ(at(2 * tiny).sign, 0);
    EXPECT_TRUE(at(tiny).is_on_triangle);
    EXPECT_FALSE(at(0).is_on_triangle);
    // Planes that a float cannot tell apart.
    const float third = 1.0f / 3;
    const float above = std::nextafter(third, 1.0f);
    EXPECT_EQ(
        exact_crossing({third, third, third}, {0, 0, above}, {1, 0, above}, {0, 1, above}).sign, 1);
    EXPECT_EQ(
        exact_crossing({third, third, above}, {0, 0, third}, {1, 0, third}, {0, 1, third}).sign, 0);
}

TEST(ExactCrossing, FindsPointsOnTrianglesWithoutArea) {
    const vec3 a(0, 0, 0);
    const vec3 b(2, 2, 2);
    EXPECT_TRUE(exact_crossing({1, 1, 1}, a, b, a).is_on_triangle);
    EXPECT_TRUE(exact_crossing({1, 1, 1}, a, {1, 1, 1}, b).is_on_triangle);
    EXPECT_FALSE(exact_crossing({3, 3, 3}, a, b, a).is_on_triangle);
    EXPECT_FALSE(exact_crossing({1, 1, std::nextafter(1.0f, 2.0f)}, a, b, a).is_on_triangle);
    EXPECT_TRUE(exact_crossing(a, a, a, a).is_on_triangle);
    EXPECT_FALSE(exact_crossing(b, a, a, a).is_on_triangle);
    // Upright.
    EXPECT_TRUE(exact_crossing({0, 1, 1}, a, {0, 3, 0}, {0, 0, 3}).is_on_triangle);
    EXPECT_FALSE(exact_crossing({0, 2, 2}, a, {0, 3, 0}, {0, 0, 3}).is_on_triangle);
}

}  // namespace
}  // namespace mray::test
