// The single-ray tracer's tests of nodes against exact boxes and the scalar slab test, on every
// target.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "common/bvh/builder/bvh_builder.h"
#include "common/interop/slab.h"
#include "common/simd/simd_target.h"
#include "tests/cpu/single_ray/single_ray_answers.h"
#include "tests/support/test_scene.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tests/cpu/single_ray/ray_streams_test.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "cpu/single_ray/node_lanes-inl.h"
#include "cpu/single_ray/ray_stream-inl.h"
#include "tests/cpu/single_ray/stream_of-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {

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

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

#include "common/simd/simd_dispatch-inl.h"

namespace mray::cpu {
namespace {

using namespace test;

HWY_EXPORT(compiled_target);
HWY_EXPORT(meet_boxes);
HWY_EXPORT(leaf_slots_of);

TEST(SimdDispatch, CallsTheFunctionOfTheTarget) {
    for (const SimdTarget& target : supported_simd_targets()) {
        EXPECT_EQ(SIMD_FUNCTION(compiled_target, target)(), target.bit) << target.name;
    }
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
    const float* const lower[3] = {node.lower_x, node.lower_y, node.lower_z};
    const float* const upper[3] = {node.upper_x, node.upper_y, node.upper_z};
    Interval result;
    for (std::uint32_t axis = 0; axis < 3; ++axis) {
        const double org = ray.org[axis];
        const double dir = ray.dir[axis];
        const double dilation = of_origin * std::abs(org) + of_extent * extent_of_rays(ray.org);
        const double from = lower[axis][slot] - dilation - org;
        const double to = upper[axis][slot] + dilation - org;
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
    float* const lower[3] = {node.lower_x, node.lower_y, node.lower_z};
    float* const upper[3] = {node.upper_x, node.upper_y, node.upper_z};
    for (std::uint32_t slot = 0; slot < kWidth; ++slot) {
        const bool is_used = slot < used;
        const double extent = kSceneExtent / static_cast<double>(1u << random.below(20));
        const vec3 a = snap_point(random.point(extent));
        const vec3 b = random.below(6) == 0 ? a : snap_point(random.point(extent));
        for (int axis = 0; axis < 3; ++axis) {
            lower[axis][slot] = is_used ? std::min(a[axis], b[axis]) : kEmptyPlane;
            upper[axis][slot] = is_used ? std::max(a[axis], b[axis]) : -kEmptyPlane;
        }
        const std::uint32_t leaf = random.below(2) == 0 ? kLeafBit : 0;
        node.child[slot] = is_used ? random.below(1000) | leaf : kEmptyChild;
    }
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
    const vec3 lower(node.lower_x[slot], node.lower_y[slot], node.lower_z[slot]);
    const vec3 upper(node.upper_x[slot], node.upper_y[slot], node.upper_z[slot]);
    SlabRay slab = slab_ray(ray.org, ray.dir);
    for (int axis = 0; axis < 3; ++axis) {
        if (ray.dir[axis] != 0) slab.rdir[axis] = 1 / ray.dir[axis];
    }
    if (!hits_box(slab, lower, upper, t_least) || t_least > last_depth(ray.tfar)) return;
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
        for (Ray& ray : rays) {
            if (round % 2 == 1) ray.tfar = static_cast<float>(random.real(0, 2) * kSceneExtent);
        }
        if (round % 4 == 3) {
            for (Ray& ray : rays) ray.org = snap_point(rays[0].org + random.point(100));
        }
        turn_to_octant(rays, random.below(8));
        const std::uint64_t all = ~std::uint64_t{0} >> (64 - rays.size());
        const std::uint64_t asked = round % 3 == 0 ? all : random.bits() & all;
        std::uint32_t leaves = 0;
        for (std::uint32_t slot = 0; slot < kWidth; ++slot) {
            leaves |= node.child[slot] >> 31 << slot;
        }
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
    EXPECT_GT(met_count, 1000u);
}

}  // namespace
}  // namespace mray::cpu

#endif  // HWY_ONCE
