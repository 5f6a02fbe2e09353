// How the single-ray tracer prepares rays and tests nodes, against the scalar functions that its
// parts stand for, on every target.
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
#include "tests/cpu/single_ray/exact_boxes.h"
#include "tests/cpu/single_ray/single_ray_answers.h"
#include "tests/support/test_scene.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tests/cpu/single_ray/ray_streams_test.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "cpu/single_ray/node_lanes-inl.h"
#include "cpu/single_ray/octant_order-inl.h"
#include "cpu/single_ray/one_ray-inl.h"
#include "cpu/single_ray/packed_rays-inl.h"
#include "cpu/single_ray/ray_bundle-inl.h"
#include "cpu/single_ray/ray_stream-inl.h"
#include "tests/cpu/single_ray/stream_of-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {

std::int64_t compiled_target() { return HWY_TARGET; }

bool is(const float (&lanes)[3][kStreamRays], std::size_t i, vec3 v) {
    const auto same = [](float a, float b) { return floatBitsToUint(a) == floatBitsToUint(b); };
    return same(lanes[0][i], v.x) && same(lanes[1][i], v.y) && same(lanes[2][i], v.z);
}

/// Whether an axis of a ray is as prepare_slab says: 1/dir rounded once, and org * rdir with room
/// for what rounds, which is little.
bool is_prepared(const RayStream& stream, std::size_t i, int axis, const Ray& ray) {
    const float dir = ray.dir[axis];
    const float rdir = dir == 0 ? kHugeReciprocal : 1 / dir;
    const float rdir_far = stream.rdir_far[axis][i];
    const double size = std::abs(double{rdir});
    const double least = double{least_dilation(ray.org)} * size;
    const double most = 1.1 * least + 0x6p-24 * std::abs(ray.org[axis]) * size;
    const double before = stream.k_near[axis][i] - double{ray.org[axis]} * rdir;
    const double behind = double{ray.org[axis]} * rdir_far - stream.k_far[axis][i];
    return stream.rdir[axis][i] == rdir && rdir_far == rdir * kStreamRounding &&
           before >= 0.8 * least && before <= most && behind >= 0.8 * least && behind <= most;
}

/// Rays that are not prepared as prepare_slab says, or not with the bits of shear_ray.
std::size_t count_stream_differences(std::span<const Ray> rays) {
    std::size_t count = 0;
    for (std::size_t first = 0; first < rays.size(); first += kStreamRays) {
        const auto part = rays.subspan(first, std::min(kStreamRays, rays.size() - first));
        const RayStream stream = stream_of(part);
        for (std::size_t i = 0; i < part.size(); ++i) {
            const ShearedRay sheared = shear_ray(part[i].org, part[i].dir);
            for (int axis = 0; axis < 3; ++axis) count += !is_prepared(stream, i, axis, part[i]);
            count += !is(stream.sheared_org, i, sheared.org) ||
                     !is(stream.sheared_dir, i, sheared.dir) || stream.axis[i] != sheared.axis ||
                     stream.depth_slack[i] != sheared.depth_slack ||
                     stream.tnear[i] != part[i].tnear || stream.tfar[i] != part[i].tfar ||
                     stream.least_dilation[i] != least_dilation(part[i].org) ||
                     stream.depth_margin[i] != depth_margin(part[i].org) ||
                     stream.last_depth[i] != last_depth(part[i].tfar);
        }
    }
    return count;
}

/// Whether a ray by itself is prepared as ray i of a stream.
bool is_prepared_alone(const RayStream& stream, std::size_t i, const Ray& ray) {
    RayStream one;
    prepare_one(one, ray);
    prepare_range_of_one(one, ray);
    const auto same = [i](const auto(&a)[kStreamRays], const auto(&b)[kStreamRays]) {
        return std::memcmp(&a[i], &b[0], sizeof b[0]) == 0;
    };
    bool all =
        same(stream.tnear, one.tnear) && same(stream.tfar, one.tfar) &&
        same(stream.least_dilation, one.least_dilation) &&
        same(stream.depth_margin, one.depth_margin) && same(stream.last_depth, one.last_depth) &&
        same(stream.axis, one.axis) && same(stream.depth_slack, one.depth_slack) &&
        same(stream.certain_from, one.certain_from) && same(stream.certain_to, one.certain_to) &&
        same(stream.certain_beyond, one.certain_beyond) &&
        same(stream.bound_linear, one.bound_linear) &&
        same(stream.bound_constant, one.bound_constant);
    for (int k = 0; k < 3; ++k) {
        all = all && same(stream.rdir[k], one.rdir[k]) &&
              same(stream.rdir_far[k], one.rdir_far[k]) && same(stream.k_near[k], one.k_near[k]) &&
              same(stream.k_far[k], one.k_far[k]) &&
              same(stream.near_offset[k], one.near_offset[k]) &&
              same(stream.sheared_org[k], one.sheared_org[k]) &&
              same(stream.sheared_dir[k], one.sheared_dir[k]);
    }
    return all;
}

/// Rays that are prepared otherwise by themselves than in a stream.
std::size_t count_alone_differences(std::span<const Ray> rays) {
    std::size_t count = 0;
    for (std::size_t first = 0; first < rays.size(); first += kStreamRays) {
        const auto part = rays.subspan(first, std::min(kStreamRays, rays.size() - first));
        const RayStream stream = stream_of(part);
        for (std::size_t i = 0; i < part.size(); ++i)
            count += !is_prepared_alone(stream, i, part[i]);
    }
    return count;
}

/// Rays whose closest hits in a leaf differ if they are packed. `asked` are few of their vectors'.
std::size_t count_packed_differences(const Leaf& leaf, std::span<const Ray> rays,
                                     std::uint64_t asked) {
    const RayStream stream = stream_of(rays);
    ClosestHits expected(stream, rays.size());
    ClosestHits actual = expected;
    for (std::uint64_t left = asked; left != 0; left &= left - 1)
        intersect_leaf_alone(stream, static_cast<std::size_t>(std::countr_zero(left)), leaf,
                             expected);
    PackedRays packed;
    packed.pack(stream, actual, asked);
    for (std::size_t i = 0; i < packed.count(); i += kLanes) packed.intersect(i, leaf, actual);
    std::size_t count = packed.count() != static_cast<std::size_t>(std::popcount(asked));
    for (std::size_t i = 0; i < rays.size(); ++i) {
        const Hit a = expected.hit(i), b = actual.hit(i);
        count += std::memcmp(&a, &b, sizeof a) != 0 || expected.last[i] != actual.last[i];
    }
    return count;
}

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
    const float end = last_entry(bundle.depth_margin, farthest);
    out.met_any = met_slots(bundle, end, node);
    std::fill(std::begin(out.met_by), std::end(out.met_by), 0);
    rays_meeting(stream, bundle, stream.last_depth, asked, node, out.near_any, out.met_by);
}

std::uint32_t leaf_slots_of(const Node& node) { return leaf_slots(node); }

/// Whether each ray is in one stream, with the others of its octant before and after it in order.
bool is_ordered(std::span<const Ray> rays) {
    std::vector<std::uint32_t> seen(rays.size());
    std::size_t previous[OctantOrder::kOctants] = {};
    bool ordered = true;
    for_each_stream(
        rays, [&](const Ray* batch, std::span<const std::uint16_t> order, std::size_t first) {
            ordered = ordered && !order.empty() && order.size() <= kStreamRays;
            const auto octant_of = [](vec3 d) { return (d.x < 0) + 2 * (d.y < 0) + 4 * (d.z < 0); };
            const int octant = octant_of(batch[order[0]].dir);
            for (const std::uint16_t i : order) {
                const std::size_t ray = first + i;
                ordered = ordered && &batch[i] == &rays[ray] && octant_of(batch[i].dir) == octant &&
                          previous[octant] <= ray;
                previous[octant] = ray;
                ++seen[ray];
            }
        });
    return ordered && std::count(seen.begin(), seen.end(), 1u) == std::ssize(seen);
}

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

#include "common/simd/simd_dispatch-inl.h"

namespace mray::cpu {
namespace {

using namespace test;

HWY_EXPORT(compiled_target);
HWY_EXPORT(count_stream_differences);
HWY_EXPORT(count_alone_differences);
HWY_EXPORT(count_packed_differences);
HWY_EXPORT(meet_boxes);
HWY_EXPORT(leaf_slots_of);
HWY_EXPORT(is_ordered);

TEST(SimdDispatch, CallsTheFunctionOfTheTarget) {
    for (const SimdTarget& target : supported_simd_targets()) {
        EXPECT_EQ(SIMD_FUNCTION(compiled_target, target)(), target.bit) << target.name;
    }
}

TEST(RayStream, DilatesSlabsAndHasTheBitsOfShearRay) {
    const TestScene scene = random_soup(100, 0.5, 1);
    std::vector<Ray> rays = rays_through(scene, 5003, 2);
    Random random(3);
    for (Ray& ray : rays) {
        if (random.below(4) == 0) ray.org = snap_point(random.point(kOriginExtent));
    }
    for (const SimdTarget& target : supported_simd_targets()) {
        EXPECT_EQ(SIMD_FUNCTION(count_stream_differences, target)(rays), 0u) << target.name;
    }
}

TEST(RayStream, PreparesARayByItselfAsInAStream) {
    const TestScene scene = random_soup(100, 0.5, 1);
    std::vector<Ray> rays = mixed_rays(scene, 5003, 5);
    Random random(6);
    for (Ray& ray : rays) {
        if (random.below(4) == 0) ray.org = snap_point(random.point(kOriginExtent));
        if (random.below(8) == 0) ray.dir[static_cast<int>(random.below(3))] = 0;
    }
    for (const SimdTarget& target : supported_simd_targets()) {
        EXPECT_EQ(SIMD_FUNCTION(count_alone_differences, target)(rays), 0u) << target.name;
    }
}

TEST(PackedRays, HaveTheClosestHitsOfRaysAlone) {
    for (const NamedScene& named : adversarial_scenes()) {
        const TestScene& scene = named.scene;
        const Bvh bvh = build_bvh(scene.topology(), scene.positions());
        Random random(7);
        for (std::size_t leaf = 0; leaf < bvh.leaves.size(); leaf += 1 + bvh.leaves.size() / 20) {
            const std::vector<Ray> rays = mixed_rays(scene, 64, 100 + leaf);
            const std::uint64_t asked =
                random.bits() & random.bits() & (leaf % 2 == 0 ? random.bits() : ~std::uint64_t{0});
            // At most half of the rays.
            if (std::popcount(asked) > 32) continue;
            for (const SimdTarget& target : supported_simd_targets()) {
                EXPECT_EQ(
                    SIMD_FUNCTION(count_packed_differences, target)(bvh.leaves[leaf], rays, asked),
                    0u)
                    << named.name << ", " << target.name;
            }
        }
    }
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

TEST(OctantOrder, KeepsTheOrderOfTheRaysOfAnOctant) {
    const TestScene scene = random_soup(100, 0.5, 1);
    for (const std::size_t size : {1, 2, 3, 4, 5, 63, 64, 65, 2047, 2048, 2049, 5003}) {
        std::vector<Ray> rays = mixed_rays(scene, size, size);
        for (std::size_t i = 0; i < size; i += 3) rays[i].dir = {0, -0.0f, -1};
        for (const SimdTarget& target : supported_simd_targets())
            EXPECT_TRUE(SIMD_FUNCTION(is_ordered, target)(rays)) << size << ", " << target.name;
    }
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
    ASSERT_TRUE((answers.met_any >> slot & 1) != 0);
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
            ASSERT_EQ(answers.met_any >> used, 0u);
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
