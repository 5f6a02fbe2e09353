#include "common/interop/arithmetic.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/interop/hit_rule.h"
#include "common/interop/slab.h"
#include "tests/support/test_scene.h"

namespace mray {
namespace {

using test::Random;

[[gnu::noinline]] float product_plus(float a, float b, float c) { return a * b + c; }
[[gnu::noinline]] float minus_product(float a, float b, float c) { return c - a * b; }
[[gnu::noinline]] float dot(const vec3& a, const vec3& b) { return dot3(a, b); }

// A fused multiply-add keeps 2^-24, the part of the product that rounding drops. Compilers fuse
// where the machine of the command line has the instruction, as aarch64 has, unless
// -ffp-contract=off forbids it.
TEST(Contraction, LeavesEveryProductRounded) {
    const volatile float a = 0x1.001p0f;
    const volatile float rounded = 0x1.002p0f;
    EXPECT_EQ(static_cast<double>(a) * a - static_cast<double>(rounded), 0x1p-24);
    EXPECT_EQ(product_plus(a, a, -rounded), 0.0f);
    EXPECT_EQ(minus_product(a, a, rounded), 0.0f);
    EXPECT_EQ(dot({a, rounded, 0.0f}, {a, -1.0f, 0.0f}), 0.0f);
}

TEST(Snap, PutsCoordinatesOnTheGridAndLeavesWhatIsThere) {
    Random random(2);
    for (int i = 0; i < 100000; ++i) {
        const auto x = static_cast<float>(
            std::ldexp(random.real(-1, 1), static_cast<int>(random.below(60)) - 40));
        const float s = snap_coordinate(x);
        EXPECT_EQ(std::remainder(static_cast<double>(s), 0x1p-40), 0.0);
        EXPECT_LE(std::abs(s - x), 0x1p-40f);
        EXPECT_EQ(snap_coordinate(s), s);
        const auto d =
            static_cast<float>(std::ldexp(random.real(-1, 1), -static_cast<int>(random.below(60))));
        EXPECT_EQ(std::remainder(static_cast<double>(snap_direction_component(d)), 0x1p-46), 0.0);
        EXPECT_EQ(std::remainder(static_cast<double>(snap_projected(s * d)), 0x1p-63), 0.0);
    }
    EXPECT_FALSE(std::signbit(snap_coordinate(-0.0f)));
    EXPECT_FALSE(std::signbit(snap_direction_component(-0.0f)));
}

TEST(CanonicalDirection, HasItsLargestComponentBetweenOneAndTwo) {
    Random random(3);
    for (int i = 0; i < 10000; ++i) {
        const vec3 d = random.point(std::ldexp(1.0, static_cast<int>(random.below(80)) - 40));
        const vec3 c = canonical_direction(d);
        EXPECT_GE(largest_component(c), 1.0f);
        EXPECT_LT(largest_component(c), 2.0f);
        const float scale = power_of_two_below(largest_component(d));
        for (int axis = 0; axis < 3; ++axis)
            EXPECT_NEAR(c[axis] * scale, d[axis], scale * 0x1p-45f);
    }
    EXPECT_EQ(canonical_direction({0, 0, 0}), vec3(0, 0, 0));
}

// 113 bits: x86's long double has 64, aarch64's has them all.
#ifdef __SIZEOF_FLOAT128__
using Quad = __float128;
#else
using Quad = long double;
static_assert(std::numeric_limits<Quad>::digits == 113);
#endif

/// The exact value of a * b - c * d, which 113 bits hold for floats of similar size.
Quad exact_difference(float a, float b, float c, float d) {
    return static_cast<Quad>(a) * b - static_cast<Quad>(c) * d;
}

TEST(DifferenceOfProducts, HasTheExactSignAndThreeUlp) {
    Random random(4);
    for (int i = 0; i < 300000; ++i) {
        const auto a = static_cast<float>(random.real(-1, 1));
        const auto b = static_cast<float>(random.real(-1, 1));
        float c = static_cast<float>(random.real(-1, 1));
        float d = static_cast<float>(random.real(-1, 1));
        if (i % 3 != 0) {  // nearly or quite parallel
            const auto s = static_cast<float>(random.real(0.5, 2));
            c = a * s;
            d = b / s;
        }
        if (i % 3 == 2) d = std::nextafter(d, 2.0f);
        const float got = difference_of_products(a, b, c, d);
        const Quad exact = exact_difference(a, b, c, d);
        EXPECT_EQ(got > 0, exact > 0);
        EXPECT_EQ(got < 0, exact < 0);
        const auto error = static_cast<double>(got - exact);
        EXPECT_LE(std::abs(error), 3 * std::abs(static_cast<double>(exact)) * 0x1p-23);
        EXPECT_EQ(difference_of_products(c, d, a, b), -got);
    }
}

TEST(Project, IsAsNearToTheRayAsTheVertexIs) {
    Random random(5);
    for (int i = 0; i < 100000; ++i) {
        const vec3 org = snap_point(random.point(kSceneExtent));
        const vec3 vertex = snap_point(random.point(kSceneExtent));
        const ShearedRay s =
            shear_ray(org, canonical_direction(vertex - org + random.point(i % 2 == 0 ? 1 : 1e5)));
        const vec3 p = project(s, vertex);
        const vec3 v = rotate_axes(vertex, s.axis);
        for (int axis = 0; axis < 2; ++axis) {
            using Real = Quad;
            const Real a = static_cast<Real>(v[axis]) - s.org[axis];
            const Real z = static_cast<Real>(v.z) - s.org.z;
            const auto exact = static_cast<double>(a * s.dir.z - s.dir[axis] * z);
            EXPECT_LE(std::abs(p[axis] - exact),
                      std::abs(exact) * 0x1p-22 + 0x1p-44 * 4 * kSceneExtent);
        }
    }
}

TEST(MayHit, NeverRejectsAHit) {
    Random random(6);
    std::size_t hits = 0;
    std::size_t kept = 0;
    constexpr int kCases = 400000;
    for (int i = 0; i < kCases; ++i) {
        const vec3 org = snap_point(random.point(4 * kSceneExtent));
        const double size = std::ldexp(kSceneExtent, -static_cast<int>(random.below(30)));
        const vec3 a = snap_point(random.point(kSceneExtent));
        const vec3 b = snap_point(a + random.point(size));
        const vec3 c = snap_point(i % 2 == 0 ? a + random.point(size)
                                             : a + (b - a) * 0.5f + random.point(size * 1e-6));
        // At a vertex, an edge, or about the triangle.
        const vec3 target = i % 3 == 0   ? a
                            : i % 3 == 1 ? a + (c - a) * 0.3f
                                         : a + random.point(size);
        const ShearedRay s = shear_ray(org, canonical_direction(target - org));
        TriangleHit hit;
        const bool is_hit = intersect_triangle(s, 0, kInfiniteT, a, b, c, hit);
        const bool may = may_hit_triangle(s, a, b, c);
        ASSERT_TRUE(may || !is_hit);
        hits += is_hit;
        kept += may;
    }
    EXPECT_GT(hits, kCases / 10u);
    EXPECT_LT(kept, kCases);
}

// Far from the origin, where the dilation is below half an ulp, a ray from the origin meets the box
// of one point that it passes exactly: only kSlabRounding pays for what the test rounds.
TEST(HitsBox, MeetsABoxOfOnePointOnTheRay) {
    Random random(31);
    for (int i = 0; i < 20000; ++i) {
        // Components of 8 digits and distances of 16, so that products are exact.
        const auto component = [&] {
            const float size = static_cast<float>(128 + random.below(128)) * 0x1p-8f;
            return random.below(2) == 0 ? size : -size;
        };
        const vec3 dir(component(), component(), component());
        const float t = static_cast<float>((1u << 15) + random.below(1u << 15)) * 0x1p3f;
        const vec3 p(dir.x * t, dir.y * t, dir.z * t);
        float t_least = 0;
        ASSERT_TRUE(hits_box(slab_ray(vec3(0, 0, 0), dir), p, p, t_least)) << i;
        ASSERT_LE(t_least, t * kDepthRounding);
    }
}

}  // namespace
}  // namespace mray
