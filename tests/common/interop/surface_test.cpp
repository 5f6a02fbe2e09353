// The directions of ambient-occlusion rays, and smooth surfaces.
#include "common/interop/surface.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <utility>

#include "common/interop/shading.h"

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

TEST(SmoothSurface, NormalsAreWeightedMeans) {
    const vec3 n = smooth_normal({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 0.25f, 0.5f);
    const float length = std::sqrt(0.375f);
    EXPECT_NEAR(n.x, 0.25f / length, 1e-6f);
    EXPECT_NEAR(n.y, 0.25f / length, 1e-6f);
    EXPECT_NEAR(n.z, 0.5f / length, 1e-6f);
}

TEST(SmoothSurface, RaysBetweenTwoSurfacesEndAtTheSecond) {
    const Surface a{{1, 2, 3}, {0, 0, 1}, 8};
    const Surface b{{-2, 2, 4}, {0, 1, 0}, 8};
    const Ray ray = ray_between(a, b);
    EXPECT_EQ(ray.org, off_surface(a, a.size));
    EXPECT_EQ(ray.tnear, 0);
    EXPECT_EQ(ray.org + ray.dir * ray.tfar, off_surface(b, b.size));
}

TEST(SmoothSurface, IsAboveTrianglesThatBulgeAndOnOthers) {
    const vec3 a(0, 0, 0), b(1, 0, 0), c(0, 1, 0), up(0, 0, 1);
    const auto at = [&](float u, float v, float tilt) {
        const Surface flat{vec3(u, v, 0), up, 2};
        return smooth_surface(flat, a, b, c, unit({-tilt, -tilt, 1}), unit({tilt, 0, 1}),
                              unit({0, tilt, 1}), u, v);
    };
    const vec3 middle(0.25f, 0.5f, 0);
    EXPECT_EQ(at(0.25f, 0.5f, 0).point, middle);
    EXPECT_EQ(at(0.25f, 0.5f, 0).normal, up);
    EXPECT_EQ(at(0.25f, 0.5f, -0.25f).point, middle);
    // The planes through the corners are 0.1875, 0.1875 and 0.125 above the point.
    const Surface above = at(0.25f, 0.5f, 0.25f);
    EXPECT_GT(above.point.z, 0.125f);
    EXPECT_LT(above.point.z, 0.1875f);
    EXPECT_GT(above.size, 2);
    for (const auto& [u, v] : {std::pair{0.0f, 0.0f}, {1.0f, 0.0f}, {0.0f, 1.0f}})
        EXPECT_EQ(at(u, v, 0.25f).point, vec3(u, v, 0));
}

}  // namespace
}  // namespace mray
