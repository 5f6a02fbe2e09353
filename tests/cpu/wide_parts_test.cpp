// The parts of the wide tracer against the scalar functions that they stand for, on every target.
#include <gtest/gtest.h>

#include <vector>

#include "common/bvh_builder.h"
#include "common/interop/slab.h"
#include "common/interop/triangle.h"
#include "cpu/simd_target.h"
#include "tests/cpu/filter_counts.h"
#include "tests/support/test_scene.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tests/cpu/wide_parts_test.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "cpu/ray_stream-inl.h"
#include "cpu/wide_leaf-inl.h"
#include "cpu/wide_node-inl.h"

HWY_BEFORE_NAMESPACE();
namespace morphray::cpu {
namespace HWY_NAMESPACE {

std::int64_t compiled_target() { return HWY_TARGET; }

bool is(const float (&lanes)[3][kStreamRays], std::size_t i, vec3 v) {
    const auto same = [](float a, float b) { return floatBitsToUint(a) == floatBitsToUint(b); };
    return same(lanes[0][i], v.x) && same(lanes[1][i], v.y) && same(lanes[2][i], v.z);
}

/// Rays whose prepared values differ from those of slab_ray and shear_ray in any bit.
std::size_t count_stream_differences(std::span<const Ray> rays) {
    std::size_t count = 0;
    for (std::size_t first = 0; first < rays.size(); first += kStreamRays) {
        const auto part = rays.subspan(first, std::min(kStreamRays, rays.size() - first));
        RayStream stream;
        fill_stream(stream, part);
        for (std::size_t i = 0; i < part.size(); ++i) {
            const SlabRay slab = slab_ray(part[i].org, part[i].dir);
            const ShearedRay sheared = shear_ray(part[i].org, part[i].dir);
            vec3 near_org = slab.org_lower;
            vec3 far_org = slab.org_upper;
            for (int axis = 0; axis < 3; ++axis) {
                if (slab.rdir[axis] < 0) std::swap(near_org[axis], far_org[axis]);
            }
            count += !is(stream.rdir, i, slab.rdir) || !is(stream.near_org, i, near_org) ||
                     !is(stream.far_org, i, far_org) || !is(stream.org, i, sheared.org) ||
                     !is(stream.dir, i, sheared.dir) || stream.axis[i] != sheared.axis ||
                     stream.tfar[i] != part[i].tfar;
        }
    }
    return count;
}

/// Slots of the node that met_slots and hits_box judge differently, for each ray up to t.
std::size_t count_box_differences(const Node& node, std::span<const Ray> rays, float t) {
    RayStream stream;
    fill_stream(stream, rays);
    std::size_t count = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        FloatVec vectors[kVectors];
        const std::uint32_t met = met_slots(stream, i, t, node, vectors);
        float t_enter[kWidth];
        for (std::size_t v = 0; v < kVectors; ++v) {
            hn::StoreU(vectors[v], kFloats, t_enter + v * kLanes);
        }
        const SlabRay slab = slab_ray(rays[i].org, rays[i].dir);
        for (std::uint32_t slot = 0; slot < kWidth; ++slot) {
            float expected;
            const bool hits =
                hits_box(slab, {node.lower_x[slot], node.lower_y[slot], node.lower_z[slot]},
                         {node.upper_x[slot], node.upper_y[slot], node.upper_z[slot]}, expected) &&
                expected <= t;
            count += hits != ((met >> slot & 1) != 0) || t_enter[slot] != expected;
        }
    }
    return count;
}

std::uint32_t leaf_slots_of(const Node& node) { return leaf_slots(node); }

FilterCounts check_filter(std::span<const Leaf> leaves, std::span<const Ray> rays) {
    FilterCounts counts;
    RayStream stream;
    fill_stream(stream, rays);
    for (const Leaf& leaf : leaves) {
        const std::uint32_t used = corner_triangle_count(leaf.vertex[0].corners);
        for (std::size_t i = 0; i < rays.size(); ++i) {
            const std::uint32_t lanes = possible_triangles(stream, i, leaf);
            std::uint32_t possible = 0;
            for (std::uint32_t lane = 0; lane < kLeafTriangles; ++lane) {
                possible |= (lanes >> lane & 1) << slot_of_lane(lane);
            }
            counts.kept_misses += possible >> used != 0;
            const ShearedRay sheared = shear_ray(rays[i].org, rays[i].dir);
            for (std::uint32_t slot = 0; slot < used; ++slot) {
                const vec3 a = leaf_position(leaf, slot, 0);
                const vec3 b = leaf_position(leaf, slot, 1);
                const vec3 c = leaf_position(leaf, slot, 2);
                TriangleHit hit;
                const bool hits = intersect_triangle(sheared, 0, kInfiniteT, a, b, c, hit);
                const bool kept = (possible >> slot & 1) != 0;
                counts.hits += hits;
                counts.lost_hits += hits && !kept;
                counts.kept_misses += kept && !may_hit_triangle(sheared, a, b, c);
                counts.left_out += !kept;
            }
        }
    }
    return counts;
}

}  // namespace HWY_NAMESPACE
}  // namespace morphray::cpu
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

#include "cpu/simd_dispatch-inl.h"

namespace morphray::cpu {
namespace {

using namespace test;

HWY_EXPORT(compiled_target);
HWY_EXPORT(count_stream_differences);
HWY_EXPORT(count_box_differences);
HWY_EXPORT(leaf_slots_of);
HWY_EXPORT(check_filter);

TEST(SimdDispatch, CallsTheFunctionOfTheTarget) {
    for (const SimdTarget& target : supported_simd_targets()) {
        EXPECT_EQ(SIMD_FUNCTION(compiled_target, target)(), target.bit) << target.name;
    }
}

/// Rays of all sorts, among them some along axes and one without a direction.
std::vector<Ray> rays_through(const TestScene& scene, std::size_t count, std::uint64_t seed) {
    std::vector<Ray> rays = mixed_rays(scene, count - 1, seed);
    rays.push_back({{1, 2, 3}, 0, {0, 0, 0}, kInfiniteT});
    return rays;
}

TEST(RayStream, HasTheBitsOfSlabRayAndShearRay) {
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

TEST(NodeTest, MeetsTheBoxesThatHitsBoxMeets) {
    const TestScene scene = random_soup(100, 0.5, 1);
    Random random(5);
    for (int round = 0; round < 400; ++round) {
        const Node node = random_node(random, random.below(kWidth + 1));
        const std::vector<Ray> rays = rays_through(scene, 64, 1000 + round);
        const auto t =
            round % 2 == 0
                ? kInfiniteT
                : static_cast<float>(random.real(0, 2) * static_cast<double>(kSceneExtent));
        std::uint32_t leaves = 0;
        for (std::uint32_t slot = 0; slot < kWidth; ++slot) {
            leaves |= node.child[slot] >> 31 << slot;
        }
        for (const SimdTarget& target : supported_simd_targets()) {
            ASSERT_EQ(SIMD_FUNCTION(count_box_differences, target)(node, rays, t), 0u)
                << target.name;
            ASSERT_EQ(SIMD_FUNCTION(leaf_slots_of, target)(node), leaves) << target.name;
        }
    }
}

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

TEST(LeafFilter, LosesNoHitAndKeepsNothingThatMayHitTriangleExcludes) {
    FilterCounts reference_counts;
    for (const NamedScene& named : adversarial_scenes()) {
        const TestScene& scene = named.scene;
        const Bvh bvh = build_bvh(scene.topology(), scene.positions());
        const std::size_t step = 1 + bvh.leaves.size() / 12;
        std::vector<Leaf> leaves;
        for (std::size_t i = 0; i < bvh.leaves.size(); i += step) leaves.push_back(bvh.leaves[i]);
        for (std::uint64_t seed = 0; seed < 12; ++seed) {
            const std::vector<Ray> rays = rays_off_surfaces(scene, 64, 100 + seed);
            for (const SimdTarget& target : supported_simd_targets()) {
                const FilterCounts counts = SIMD_FUNCTION(check_filter, target)(leaves, rays);
                EXPECT_EQ(counts.lost_hits, 0u) << named.name << ", " << target.name;
                EXPECT_EQ(counts.kept_misses, 0u) << named.name << ", " << target.name;
                reference_counts.hits += counts.hits;
                reference_counts.left_out += counts.left_out;
            }
        }
    }
    EXPECT_GT(reference_counts.hits, 10000u);
    EXPECT_GT(reference_counts.left_out, 100000u);
}

}  // namespace
}  // namespace morphray::cpu

#endif  // HWY_ONCE
