// Compares the bounds of distances with the rule, on every target: a bound is never above the
// distance of the rule, and at least 0.99 of it.
#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>

#include "common/interop/closest_rule.h"
#include "common/simd/simd_target.h"
#include "tests/cpu/queries/side_counts.h"
#include "tests/support/test_scene.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tests/cpu/queries/triangle_sides_test.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "cpu/queries/triangle_sides-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {

/// Asks about points near a triangle that is in all lanes.
test::SideCounts check_sides(std::size_t triangles) {
    test::SideCounts counts;
    constexpr float kExtent = 8;
    test::Random random(17);
    for (std::size_t t = 0; t < triangles; ++t) {
        // No needle: its directions are inaccurate, and so are bounds.
        const vec3 a = random.point(1) + vec3(3, 0, 0);
        const vec3 b = random.point(1) + vec3(0, 3, 0);
        const vec3 c = random.point(1) + vec3(0, 0, 3);
        const TriangleSides sides(lanes::Float3(a), lanes::Float3(b), lanes::Float3(c),
                                  splat(kExtent));
        for (int i = 0; i < 40; ++i) {
            const vec3 p = random.point(kExtent);
            const NearPoint nearest = closest_on_triangle(p, a, b, c);
            if (nearest.d2 < 1) continue;
            const lanes::Float3 at(p);
            const FloatVec bound = sides.distance2(0, at);
            counts.above += !none(bound > splat(nearest.d2));
            counts.above += none(sides.may_be_within(0, at, splat(nearest.d2)));
            const float least = 0.99f * nearest.d2;
            const bool is_vertex = nearest.u == 1 || nearest.v == 1 || nearest.u + nearest.v == 0;
            if (is_vertex) {
                ++counts.vertices;
                counts.below += !none(sides.may_be_within(0, at, splat(least)));
            } else {
                ++counts.others;
                counts.below += !none(bound < splat(least));
            }
        }
    }
    return counts;
}

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

#include "common/simd/simd_dispatch-inl.h"

namespace mray::cpu {
namespace {

HWY_EXPORT(check_sides);

TEST(TriangleSides, BoundDistancesClosely) {
    for (const SimdTarget& target : supported_simd_targets()) {
        const test::SideCounts counts = SIMD_FUNCTION(check_sides, target)(500);
        EXPECT_EQ(counts.above, 0u) << target.name;
        EXPECT_EQ(counts.below, 0u) << target.name;
        EXPECT_GT(counts.vertices, 1000u) << target.name;
        EXPECT_GT(counts.others, 1000u) << target.name;
    }
}

}  // namespace
}  // namespace mray::cpu

#endif  // HWY_ONCE
