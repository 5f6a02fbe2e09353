// The tests of leaves of the single-ray tracer against the scalar hit rule, on every target.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <span>
#include <vector>

#include "common/bvh/builder/bvh_builder.h"
#include "common/interop/hit_rule.h"
#include "common/interop/slab.h"
#include "common/simd/simd_target.h"
#include "tests/cpu/single_ray/single_ray_answers.h"
#include "tests/support/test_scene.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tests/cpu/single_ray/leaf_tests_test.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "cpu/single_ray/leaf-inl.h"
#include "cpu/single_ray/ray_stream-inl.h"
#include "tests/cpu/single_ray/stream_of-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {

struct Certainty {
    /// By certain_occluders().
    bool occludes;
    /// By certainly_beyond().
    bool is_beyond;
};

/// Returns what is certain about a triangle.
Certainty certainty_of(const RayStream& stream, std::size_t ray, vec3 a, vec3 b, vec3 c) {
    const lanes::ShearedRay s = sheared_ray(stream, ray);
    const auto project = [&s](vec3 v) HWY_ATTR {
        return lanes::project_rotated_fast(s, lanes::rotate_axes(lanes::Float3(v), s.axis));
    };
    const lanes::Float3 pa = project(a), pb = project(b), pc = project(c);
    const lanes::Edges e = lanes::fast_edges(pa, pb, pc);
    const DepthSum depth = depth_sum(e, pa.z, pb.z, pc.z, s.dir.z);
    const CertainRange range = certain_range(stream, ray);
    return {finite_vertices(a, b, c) && !none(certain_occluders(e, depth, range)),
            !none(certainly_beyond(e, depth, range))};
}

/// Sizes and depths of triangles whose edge_bound() is above the bound that asks for no depth.
std::size_t check_depthless_bounds(std::size_t count) {
    test::Random random(3);
    const auto scaled = [&random](int least, int most) {
        const int exponent = least + static_cast<int>(random.below(most - least));
        return std::ldexp(static_cast<float>(random.real(1, 2)), exponent);
    };
    std::size_t above = 0;
    for (std::size_t i = 0; i < count; ++i) {
        const float org = random.below(4) == 0 ? 0.0f : scaled(-20, 40);
        const float depth = most_depth(org);
        const float m = random.below(8) == 0 ? 0.0f : scaled(-60, 42);
        const float z =
            random.below(2) == 0 ? depth : depth * static_cast<float>(random.real(0, 1));
        const DepthlessBound<float> bound = depthless_bound(depth);
        const DepthlessBound<FloatVec> bounds{splat(bound.linear), splat(bound.constant)};
        above += !none(bounds(splat(m)) < lanes::edge_bound(splat(m), splat(z)));
    }
    return above;
}

/// The closest hits of the rays of `asked` in a leaf, lanes being rays or triangles.
ClosestHits closest_in_leaf(const RayStream& stream, std::size_t count, std::uint64_t asked,
                            const Leaf& leaf, bool together) {
    ClosestHits closest(stream, count);
    for (std::size_t first = 0; first < count; first += kLanes) {
        auto rays = static_cast<std::uint32_t>(asked >> first & kLaneBits);
        if (together && rays != 0) {
            intersect_leaf_together(stream, first, rays, leaf, closest);
            continue;
        }
        for (; rays != 0; rays &= rays - 1) {
            const auto lane = static_cast<std::size_t>(std::countr_zero(rays));
            intersect_leaf_alone(stream, first + lane, leaf, closest);
        }
    }
    return closest;
}

bool same_hit(const Hit& a, const Hit& b) { return std::memcmp(&a, &b, sizeof a) == 0; }

/// Pairs of ray and slot that intersect_leaf answers otherwise than the scalar rule, certain
/// occluders whose depth is not far enough within the ray's range, hits certainly beyond it, and
/// rays that any of the other tests of leaves answers otherwise.
LeafCounts check_leaf(const Leaf& leaf, std::span<const Ray> rays, std::uint64_t asked) {
    LeafCounts counts;
    const RayStream stream = stream_of(rays);
    const std::uint64_t by_leaf = rays_hitting(stream, asked, leaf);
    const ClosestHits alone = closest_in_leaf(stream, rays.size(), asked, leaf, false);
    const ClosestHits together = closest_in_leaf(stream, rays.size(), asked, leaf, true);
    const std::uint32_t used = corner_triangle_count(leaf.vertex[0].corners);
    for (std::size_t i = 0; i < rays.size(); ++i) {
        TriangleHit found[kLeafTriangles];
        std::uint32_t slots = 0;
        intersect_leaf(stream, i, rays[i].tfar, leaf,
                       [&](std::uint32_t slot, const TriangleHit& hit) {
                           counts.differences += slots >> slot & 1;
                           slots |= 1u << slot;
                           found[slot] = hit;
                           return false;
                       });
        const ShearedRay sheared = shear_ray(rays[i].org, rays[i].dir);
        const float size = std::max(largest_component(rays[i].org), kSceneExtent);
        const double margin = 0x1p-18 * size;
        Hit closest = no_hit();
        float closest_t = rays[i].tfar;
        bool any = false;
        for (std::uint32_t slot = 0; slot < kLeafTriangles; ++slot) {
            TriangleHit hit;
            const vec3 a = leaf_position(leaf, slot, 0);
            const vec3 b = leaf_position(leaf, slot, 1);
            const vec3 c = leaf_position(leaf, slot, 2);
            const bool hits = slot < used && intersect_triangle(sheared, rays[i].tnear,
                                                                rays[i].tfar, a, b, c, hit);
            any |= hits;
            counts.hits += hits;
            counts.differences += hits != ((slots >> slot & 1) != 0) ||
                                  (hits && (hit.t != found[slot].t || hit.u != found[slot].u ||
                                            hit.v != found[slot].v));
            const Certainty certainty = certainty_of(stream, i, a, b, c);
            if (slot < used && certainty.is_beyond) {
                ++counts.beyond;
                counts.differences += hits;
            }
            if (slot < used && certainty.occludes) {
                ++counts.certain;
                counts.differences +=
                    !hits || hit.t < rays[i].tnear + margin || hit.t > rays[i].tfar - margin;
            }
            if (hits && is_closer(hit.t, leaf.prim_id[slot], closest_t, closest.prim_id)) {
                closest_t = hit.t;
                closest = make_hit(hit, leaf.prim_id[slot]);
            }
        }
        const bool is_asked = (asked >> i & 1) != 0;
        counts.differences += (by_leaf >> i & 1) != (is_asked && any);
        counts.differences += occluded_by_leaf(stream, i, leaf) != any;
        const Hit expected = is_asked ? closest : no_hit();
        counts.differences += !same_hit(alone.hit(i), expected);
        counts.differences += !same_hit(together.hit(i), expected);
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

using namespace test;

HWY_EXPORT(check_leaf);
HWY_EXPORT(check_depthless_bounds);

/// Rays that leave from just off a triangle, on either side, as secondary rays do.
std::vector<Ray> rays_off_surfaces(const TestScene& scene, std::size_t count, std::uint64_t seed) {
    std::vector<Ray> rays = rays_through(scene, count, seed);
    const auto& triangles = scene.topology().triangles;
    if (triangles.empty()) return rays;
    Random random(seed);
    for (std::size_t i = 0; i < count; i += 2) {
        const uvec3 t = triangles[random.below(static_cast<std::uint32_t>(triangles.size()))];
        const vec3 a = scene.positions()[t.x];
        const vec3 b = scene.positions()[t.y];
        const vec3 c = scene.positions()[t.z];
        if (!finite_vertices(a, b, c)) continue;
        const auto u = static_cast<float>(random.real(0, 1));
        const auto v = static_cast<float>(random.real(0, 1)) * (1 - u);
        const auto step = static_cast<float>(1 << random.below(8));
        rays[i].org = snap_point(a + (b - a) * u + (c - a) * v + random.point(step));
    }
    return rays;
}

TEST(LeafTest, HasTheHitsOfTheScalarRule) {
    std::size_t hits = 0, certain = 0, beyond = 0;
    for (const NamedScene& named : adversarial_scenes()) {
        const TestScene& scene = named.scene;
        const Bvh bvh = build_bvh(scene.topology(), scene.positions());
        const std::size_t step = 1 + bvh.leaves.size() / 12;
        Random random(11);
        for (std::size_t leaf = 0; leaf < bvh.leaves.size(); leaf += step) {
            for (std::uint64_t seed = 0; seed < 12; ++seed) {
                std::vector<Ray> rays = rays_off_surfaces(scene, 1 + random.below(64), 100 + seed);
                for (Ray& ray : rays) {
                    if (random.below(4) == 0) {
                        ray.tfar = static_cast<float>(random.real(0, 1) * kSceneExtent);
                        ray.tnear = ray.tfar * static_cast<float>(random.real(0, 1));
                    }
                }
                const std::uint64_t all = ~std::uint64_t{0} >> (64 - rays.size());
                const std::uint64_t asked = seed % 3 == 0 ? all : random.bits() & all;
                for (const SimdTarget& target : supported_simd_targets()) {
                    const LeafCounts counts =
                        SIMD_FUNCTION(check_leaf, target)(bvh.leaves[leaf], rays, asked);
                    ASSERT_EQ(counts.differences, 0u) << named.name << ", " << target.name;
                    hits += counts.hits;
                    certain += counts.certain;
                    beyond += counts.beyond;
                }
            }
        }
    }
    EXPECT_GT(hits, 1000u);
    EXPECT_GT(certain, 1000u);
    EXPECT_GT(beyond, 1000u);
}

TEST(LeafTest, BoundsEdgeFunctionsAtEveryDepth) {
    for (const SimdTarget& target : supported_simd_targets())
        EXPECT_EQ(SIMD_FUNCTION(check_depthless_bounds, target)(100000), 0u) << target.name;
}

}  // namespace
}  // namespace mray::cpu

#endif  // HWY_ONCE
