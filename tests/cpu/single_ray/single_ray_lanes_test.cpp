// The single-ray tracer's tests of nodes against exact boxes and the scalar slab test, and of
// leaves against the scalar hit rule, on every target.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <span>
#include <vector>

#include "common/bvh/builder/bvh_builder.h"
#include "common/interop/hit_rule.h"
#include "common/interop/slab.h"
#include "common/simd/simd_target.h"
#include "cpu/reference/scalar_tracer.h"
#include "tests/cpu/single_ray/single_ray_answers.h"
#include "tests/support/same_bits.h"
#include "tests/support/test_scene.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tests/cpu/single_ray/single_ray_lanes_test.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "cpu/single_ray/leaf-inl.h"
#include "cpu/single_ray/node_lanes-inl.h"
#include "cpu/single_ray/ray_stream-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {

/// The stream of all rays in their order.
inline RayStream stream_of(std::span<const Ray> rays) {
    std::vector<std::uint16_t> order(rays.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = static_cast<std::uint16_t>(i);
    return make_stream(rays.data(), order);
}

std::int64_t compiled_target() { return HWY_TARGET; }

/// The answers for at most kStreamRays rays of one octant and the node's boxes up to their
/// last_depth: for each ray, for all, and by rays_meeting for the rays of `asked`.
void meet_boxes(const Node& node, std::span<const Ray> rays, std::uint64_t asked, BoxAnswers& out) {
    const RayStream stream = stream_of(rays);
    FloatVec least[kVectors];
    for (std::size_t i = 0; i < rays.size(); ++i) {
        out.met[i] = met_slots(stream, i, node);
        out.near[i] = near_slots(stream, i, stream.last_depth[i], node, least);
        for (std::size_t v = 0; v < kVectors; ++v)
            store_unaligned(least[v], out.t_least[i] + v * kLanes);
    }
    const RayBundle bundle = bundle_of(stream, rays.size());
    const float farthest = largest_of(stream.last_depth, rays.size());
    out.near_any = near_slots(bundle, farthest, node, least);
    for (std::size_t v = 0; v < kVectors; ++v)
        store_unaligned(least[v], out.least_of_all + v * kLanes);
    std::fill(std::begin(out.met_by), std::end(out.met_by), 0);
    rays_meeting(stream, bundle, stream.last_depth, asked, node, out.near_any, out.met_by);
}

std::uint32_t leaf_slots_of(const Node& node) { return leaf_slots(node); }

struct Certainty {
    /// By certain_occluders().
    bool occludes;
    /// By certainly_beyond().
    bool is_beyond;
};

/// Returns what is certain about a triangle.
Certainty certainty_of(const RayStream& stream, std::size_t ray, vec3 a, vec3 b, vec3 c) {
    const lanes::ShearedRay s = sheared(stream, OneRay{ray});
    const auto project = [&s](vec3 v) HWY_ATTR {
        return lanes::project_rotated_fast(s, lanes::rotate_axes(lanes::Float3(v), s.axis));
    };
    const lanes::Float3 pa = project(a), pb = project(b), pc = project(c);
    const lanes::Edges e = lanes::fast_edges(pa, pb, pc);
    const DepthSum depth = depth_sum(e, pa.z, pb.z, pc.z, s.dir.z);
    const CertainRange range = certain_range(stream, OneRay{ray});
    return {finite_vertices(a, b, c) && !none(certain_occluders(e, depth, range)),
            !none(certainly_beyond(e, depth, range, own_beyond_bound(e)))};
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
        counts.differences += !test::same_bits(alone.hit(i), expected);
        counts.differences += !test::same_bits(together.hit(i), expected);
    }
    return counts;
}

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

#include "common/simd/simd_dispatch-inl.h"

namespace mray::cpu {

HWY_EXPORT(compiled_target);
HWY_EXPORT(meet_boxes);
HWY_EXPORT(leaf_slots_of);
HWY_EXPORT(check_leaf);
HWY_EXPORT(check_depthless_bounds);

namespace {

using namespace test;

TEST(SimdDispatch, CallsTheFunctionOfTheTarget) {
    for (const SimdTarget& target : supported_simd_targets())
        EXPECT_EQ(SIMD_FUNCTION(compiled_target, target)(), target.bit) << target.name;
}

/// From where to where a line is within a box, from 0 on, and where it enters on its main axis; in
/// exact arithmetic but for some units of double.
struct Interval {
    double enter = 0;
    double leave = kInfiniteT;
    double along = 0;
};

/// The box is dilated by these parts of |org| and of the rays' extent.
Interval exact_interval(const Node& node, std::uint32_t slot, const Ray& ray, double of_origin,
                        double of_extent) {
    const Box box = slot_box(node, slot);
    Interval result;
    for (std::uint32_t axis = 0; axis < 3; ++axis) {
        const double org = ray.org[axis];
        const double dir = ray.dir[axis];
        const double dilation = of_origin * std::abs(org) + of_extent * extent_of_rays(ray.org);
        const double from = box.lower[axis] - dilation - org;
        const double to = box.upper[axis] + dilation - org;
        if (dir == 0) {
            if (from > 0 || to < 0) result.leave = -1;
            continue;
        }
        const double entry = std::min(from / dir, to / dir);
        result.enter = std::max(result.enter, entry);
        result.leave = std::min(result.leave, std::max(from / dir, to / dir));
        if (axis == largest_axis(ray.dir)) result.along = entry;
    }
    return result;
}

/// Whether this is an answer that the proof in cpu/single_ray/node_lanes-inl.h allows: every box
/// that the line passes within 2^-42 of the extent is met, and none that it passes at some ulp.
bool is_allowed(const Node& node, std::uint32_t slot, const Ray& ray, bool near, float t_least) {
    const Interval inner = exact_interval(node, slot, ray, 0, 0x1p-42);
    const Interval outer = exact_interval(node, slot, ray, 0x1p-21, 0x1p-39);
    if (inner.enter <= std::min<double>(inner.leave, ray.tfar) &&
        !(near && t_least <= inner.enter * (1 + 0x1p-21))) {
        return false;
    }
    // A ray without a direction meets some at once that it is not in, far beyond any t.
    if (largest_component(ray.dir) == 0) return true;
    const double margin = depth_margin(ray.org);
    const double least = std::max(outer.along, outer.enter - margin);
    const double rounding = 0x1p-19 * std::max(std::abs(outer.along), outer.enter);
    return !near || (outer.enter <= outer.leave * (1 + 0x1p-19) &&
                     least <= ray.tfar * (1 + 0x1p-19) + rounding && t_least >= least - rounding);
}

/// Boxes of any size and place in the first `used` slots, some flat or a point; the rest is empty.
Node random_node(Random& random, std::uint32_t used) {
    Node node;
    for (std::uint32_t slot = 0; slot < used; ++slot) {
        const double extent = kSceneExtent / static_cast<double>(1u << random.below(20));
        const vec3 a = snap_point(random.point(extent));
        const vec3 b = random.below(6) == 0 ? a : snap_point(random.point(extent));
        Box box;
        box.extend(a);
        box.extend(b);
        set_slot_box(node, slot, box);
        const bool is_node = random.below(2) != 0;
        const std::uint32_t index = random.below(1000);
        set_child(node, slot, is_node ? index : leaf_child(index));
    }
    clear_slots(node, used);
    return node;
}

/// Rays of one octant; a zero counts as positive.
void turn_to_octant(std::vector<Ray>& rays, std::uint32_t octant) {
    for (Ray& ray : rays) {
        for (int axis = 0; axis < 3; ++axis) {
            const float size = std::abs(ray.dir[axis]);
            const bool negative = (octant >> axis & 1) != 0;
            ray.dir[axis] = negative ? -std::max(size, 0x1p-46f) : size;
        }
    }
}

/// Whether the slab test of a ray alone meets the box in the slot, and then all of the bundle does,
/// with a least depth that is no larger, bit for bit.
void expect_bound_of_slabs(const Node& node, std::uint32_t slot, const Ray& ray,
                           const BoxAnswers& answers) {
    float t_least = 0;
    const Box box = slot_box(node, slot);
    SlabRay slab = slab_ray(ray.org, ray.dir);
    for (int axis = 0; axis < 3; ++axis)
        if (ray.dir[axis] != 0) slab.rdir[axis] = 1 / ray.dir[axis];
    if (!hits_box(slab, box.lower, box.upper, t_least) || t_least > last_depth(ray.tfar)) return;
    ASSERT_TRUE((answers.near_any >> slot & 1) != 0);
    ASSERT_LE(answers.least_of_all[slot], t_least);
}

TEST(NodeTest, MeetsTheBoxesOfAllHitsAndNoneThatAreFartherThanRoundingExplains) {
    const TestScene scene = random_soup(100, 0.5, 1);
    Random random(5);
    std::size_t met_count = 0;
    for (int round = 0; round < 400; ++round) {
        const std::uint32_t used = random.below(kWidth + 1);
        const Node node = random_node(random, used);
        std::vector<Ray> rays = rays_through(scene, 1 + random.below(64), 1000 + round);
        for (Ray& ray : rays)
            if (round % 2 == 1) ray.tfar = static_cast<float>(random.real(0, 2) * kSceneExtent);
        if (round % 4 == 3)
            for (Ray& ray : rays) ray.org = snap_point(rays[0].org + random.point(100));
        turn_to_octant(rays, random.below(8));
        const std::uint64_t all = ~std::uint64_t{0} >> (64 - rays.size());
        const std::uint64_t asked = round % 3 == 0 ? all : random.bits() & all;
        std::uint32_t leaves = 0;
        for (std::uint32_t slot = 0; slot < kWidth; ++slot)
            leaves |= (is_leaf(child_of(node, slot)) ? 1u : 0u) << slot;
        for (const SimdTarget& target : supported_simd_targets()) {
            SCOPED_TRACE(target.name);
            ASSERT_EQ(SIMD_FUNCTION(leaf_slots_of, target)(node), leaves);
            BoxAnswers answers;
            SIMD_FUNCTION(meet_boxes, target)(node, rays, asked, answers);
            ASSERT_EQ(answers.near_any >> used, 0u);
            for (std::size_t i = 0; i < rays.size(); ++i) {
                ASSERT_EQ(answers.met[i] >> used, 0u);
                for (std::uint32_t slot = 0; slot < used; ++slot) {
                    const bool met = (answers.met[i] >> slot & 1) != 0;
                    const bool near = (answers.near[i] >> slot & 1) != 0;
                    const float t_least = answers.t_least[i][slot];
                    met_count += met;
                    ASSERT_TRUE(met || !near);
                    ASSERT_TRUE(is_allowed(node, slot, rays[i], near, t_least));
                    ASSERT_NO_FATAL_FAILURE(expect_bound_of_slabs(node, slot, rays[i], answers));
                    const std::uint64_t met_by = answers.met_by[slot];
                    ASSERT_EQ(met_by & ~asked, 0u);
                    if ((asked >> i & 1) == 0) continue;
                    // The same operations in the same order, for boxes that the bundle meets.
                    const bool by_any = (answers.near_any >> slot & 1) != 0;
                    ASSERT_EQ((met_by >> i & 1) != 0, met && by_any);
                }
            }
        }
    }
    EXPECT_GT(met_count, 500u);
}

/// Rays that leave from just off a triangle, on either side, as secondary rays do.
std::vector<Ray> rays_off_surfaces(const TestScene& scene, std::size_t count, std::uint64_t seed) {
    std::vector<Ray> rays = rays_through(scene, count, seed);
    const auto& triangles = scene.topology().triangles;
    if (triangles.empty()) return rays;
    Random random(seed);
    for (std::size_t i = 0; i < count; i += 2) {
        const uvec3 t = random.pick(triangles);
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

/// Ends a ray just before a triangle of the leaf that it hits, as shadow rays end.
void end_before_hit(const Leaf& leaf, int gap_exponent, Ray& ray) {
    const ShearedRay sheared = shear_ray(ray.org, ray.dir);
    float end = ray.tfar;
    for_each_triangle(leaf, [&](vec3 a, vec3 b, vec3 c, std::uint32_t) {
        TriangleHit hit;
        if (intersect_triangle(sheared, ray.tnear, ray.tfar, a, b, c, hit))
            end = hit.t - std::ldexp(hit.t, gap_exponent);
    });
    ray.tfar = end;
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
                    if (random.below(4) != 0)
                        end_before_hit(bvh.leaves[leaf], -10 - static_cast<int>(random.below(14)),
                                       ray);
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
