// The directions of ambient-occlusion rays.
#include "common/interop/surface.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

namespace mray {
namespace {

TEST(AoDirections, EverySquareOfPixelsHasEachNumberOnce) {
    for (const uint sample : {0u, 1u, 255u}) {
        for (uint y0 = 0; y0 < 9; ++y0) {
            for (uint x0 = 0; x0 < 9; ++x0) {
                std::set<uint> numbers;
                for (uint i = 0; i < 16; ++i)
                    numbers.insert(ao_number(x0 + i % 4, y0 + i / 4, sample));
                EXPECT_EQ(numbers.size(), 16u);
                EXPECT_EQ(*numbers.begin(), 16 * sample);
                EXPECT_EQ(*numbers.rbegin(), 16 * sample + 15);
            }
        }
    }
}

TEST(AoDirections, PointsAreOnTheUnitSphere) {
    for (uint n = 0; n < 200000; ++n) {
        const vec3 p = sphere_point(n);
        const double length = std::hypot(static_cast<double>(p.x), static_cast<double>(p.y),
                                         static_cast<double>(p.z));
        // Near the poles the radius is cut off below 2^-10.
        ASSERT_NEAR(length, 1, std::abs(p.z) > 0.9999995f ? 1e-3 : 1e-5) << n;
    }
}

TEST(AoDirections, PointsFillTheSphereEvenly) {
    // Any 256 points in a row: their mean, and their number in each octant.
    for (uint first = 0; first < 100000; first += 997) {
        glm::dvec3 sum(0);
        int octants[8] = {};
        for (uint n = first; n < first + 256; ++n) {
            const vec3 p = sphere_point(n);
            sum += glm::dvec3(p);
            ++octants[(p.x > 0 ? 1 : 0) + (p.y > 0 ? 2 : 0) + (p.z > 0 ? 4 : 0)];
        }
        // Random points would be off by 0.06, and 32 +- 5.
        for (int k = 0; k < 3; ++k) EXPECT_LT(std::abs(sum[k]) / 256, 0.03) << first;
        for (const int count : octants) EXPECT_NEAR(count, 32, 6) << first;
    }
}

TEST(AoDirections, AreDistributedByTheCosine) {
    for (const vec3 normal : {vec3(0, 1, 0), unit(vec3(1, 2, -3)), unit(vec3(-5, 0.1f, 0.2f))}) {
        Surface surface;
        surface.normal = normal;
        double sum = 0;
        int steep = 0;
        constexpr int kCount = 4096;
        for (uint n = 0; n < kCount; ++n) {
            const double cosine = dot3(ao_direction(surface, sphere_point(n)), normal);
            EXPECT_GT(cosine, 0);
            sum += cosine;
            steep += cosine > std::sqrt(0.5) ? 1 : 0;
        }
        EXPECT_NEAR(sum / kCount, 2.0 / 3, 2e-3);
        EXPECT_NEAR(static_cast<double>(steep) / kCount, 0.5, 5e-3);
    }
}

}  // namespace
}  // namespace mray
