#include "cpu/single_ray/single_ray_tracer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cfenv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/bvh/builder/bvh_builder.h"
#include "cpu/reference/scalar_tracer.h"
#include "tests/support/same_bits.h"
#include "tests/support/test_scene.h"

namespace mray {
namespace {

using namespace test;

/// Rays whose closest hit is not the expected one, or whose any hit does not agree with it, in
/// calls of `batch` rays.
std::size_t count_differences(const cpu::SingleRayTracer& tracer, std::span<const Ray> rays,
                              const std::vector<Hit>& expected, std::size_t batch) {
    std::vector<Hit> hits(rays.size());
    std::vector<std::uint8_t> occluded(rays.size(), 7);
    for (std::size_t first = 0; first < rays.size(); first += batch) {
        const std::size_t count = std::min(batch, rays.size() - first);
        tracer.intersect(rays.subspan(first, count), std::span(hits).subspan(first, count));
        tracer.occluded(rays.subspan(first, count), std::span(occluded).subspan(first, count));
    }
    std::size_t different = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        const bool is_hit = expected[i].prim_id != kNoPrim;
        different += !same_bits(hits[i], expected[i]) || occluded[i] != is_hit;
    }
    return different;
}

TEST(SingleRayTracer, AnswersABatchOfAnySizeAndNothingBesides) {
    const TestScene scene = random_soup(400, 0.3, 7);
    const Bvh bvh = build_bvh(scene.topology(), scene.positions());
    const std::vector<Ray> rays = mixed_rays(scene, 2100, 3);
    const cpu::ScalarTracer scalar(bvh);
    const Hit untouched{-1, -2, -3, 77};
    for (const SimdTarget& target : supported_simd_targets()) {
        const cpu::SingleRayTracer tracer(bvh, target);
        for (const std::size_t size :
             {0, 1, 2, 3, 4, 7, 13, 16, 17, 33, 64, 70, 2047, 2049, 2100}) {
            std::vector<Hit> hits(size + 1, untouched);
            std::vector<std::uint8_t> occluded(size + 1, 7);
            tracer.intersect({rays.data(), size}, {hits.data(), size});
            tracer.occluded({rays.data(), size}, {occluded.data(), size});
            for (std::size_t i = 0; i < size; ++i) {
                EXPECT_TRUE(same_bits(hits[i], scalar.intersect(rays[i])));
                EXPECT_EQ(occluded[i], scalar.occluded(rays[i]));
            }
            EXPECT_TRUE(same_bits(hits[size], untouched));
            EXPECT_EQ(occluded[size], 7);
        }
    }
}

/// Rays in pencils of 1 to 200 that have nearly one origin and one direction, so that they go down
/// together: jittered by up to 2^-40 to 2^-2 of the scene, some equal, some with a range of t.
std::vector<Ray> pencils_of_rays(const TestScene& scene, std::size_t count, std::uint64_t seed) {
    Random random(seed);
    const std::vector<Ray> axes = mixed_rays(scene, count, seed);
    std::vector<Ray> rays;
    for (const Ray& axis : axes) {
        const double spread = std::ldexp(1.0, -2 - static_cast<int>(random.below(39)));
        for (std::uint32_t left = 1 + random.below(200); left > 0; --left) {
            Ray ray = axis;
            ray.org = snap_point(ray.org + random.point(spread * kSceneExtent));
            const vec3 dir = canonical_direction(ray.dir + random.point(spread));
            if (largest_component(dir) > 0) ray.dir = dir;
            if (random.below(4) == 0) ray = rays.empty() ? ray : rays.back();
            if (random.below(4) == 0) {
                ray.tfar = static_cast<float>(random.real(0, 2) * kSceneExtent);
                ray.tnear = ray.tfar * static_cast<float>(random.real(0, 1));
            }
            rays.push_back(ray);
        }
    }
    return rays;
}

TEST(SingleRayTracer, HasTheBitsOfBruteForceForAnyRaysAndForRaysThatGoDownTogether) {
    std::size_t hit_count = 0;
    for (const NamedScene& named : adversarial_scenes()) {
        const TestScene& scene = named.scene;
        const Bvh bvh = build_bvh(scene.topology(), scene.positions());
        const cpu::BruteTracer brute(scene.topology(), scene.positions());
        for (const std::vector<Ray>& rays :
             {mixed_rays(scene, 3000, 17), pencils_of_rays(scene, 24, 41)}) {
            std::vector<Hit> expected;
            for (const Ray& ray : rays) {
                expected.push_back(brute.intersect(ray));
                hit_count += expected.back().prim_id != kNoPrim;
            }
            for (const SimdTarget& target : supported_simd_targets()) {
                const cpu::SingleRayTracer tracer(bvh, target);
                // In calls of few rays, too, as packets of other libraries are.
                for (const std::size_t batch : {rays.size(), std::size_t{1}, std::size_t{4},
                                                std::size_t{7}, std::size_t{16}}) {
                    EXPECT_EQ(count_differences(tracer, rays, expected, batch), 0u)
                        << named.name << ", " << target.name << ", " << batch;
                }
            }
        }
    }
    EXPECT_GT(hit_count, 5000u);
}

/// A ray about in the plane of a triangle, towards one of its points: where rounding alone makes it
/// hit, t may be the depth at which the dilated box of the triangle begins.
Ray ray_in_plane(const vec3 (&corners)[3], Random& random) {
    const double v = random.real(0, 1), w = random.real(0, 1 - v);
    const dvec3 a(corners[0]), b = dvec3(corners[1]) - a, c = dvec3(corners[2]) - a;
    const dvec3 dir = b * random.real(-1, 1) + c * random.real(-1, 1);
    const dvec3 org = a + b * v + c * w - dir * random.magnitude(0x1p-5, 4);
    return {snap_point(vec3(org)), 0, canonical_direction(vec3(dir)), kInfiniteT};
}

TEST(SingleRayTracer, FindsTheHitsWhereTheBoxOfATriangleBegins) {
    Random random(5);
    const TestScene scene({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}});
    std::size_t hit_count = 0;
    for (int round = 0; round < 400; ++round) {
        vec3 corners[3];
        const vec3 middle = random.point(0.8 * kSceneExtent);
        const double size = random.magnitude(0x1p-5, 0.5) * kSceneExtent;
        for (vec3& corner : corners) corner = snap_point(middle + random.point(size));
        const Bvh bvh = build_bvh(scene.topology(), corners);
        const cpu::BruteTracer brute(scene.topology(), corners);
        std::vector<Ray> rays;
        std::vector<Hit> expected;
        for (int i = 0; i < 2000; ++i) {
            Ray ray = ray_in_plane(corners, random);
            const Hit hit = brute.intersect(ray);
            if (hit.prim_id == kNoPrim) continue;
            ray.tfar = hit.t;
            rays.push_back(ray);
            expected.push_back(hit);
        }
        hit_count += rays.size();
        for (const SimdTarget& target : supported_simd_targets())
            EXPECT_EQ(count_differences({bvh, target}, rays, expected, 1), 0u) << target.name;
    }
    EXPECT_GT(hit_count, 10'000u);
}

/// A chain of kMaxDepth nodes whose boxes are all the same: each holds the next one in `slot` and
/// in all others the leaf of a triangle in front of the origin, the last one leaves alone.
Bvh deepest_chain(std::uint32_t slot) {
    Bvh bvh;
    bvh.leaves.resize(1);
    Leaf& leaf = bvh.leaves[0];
    for (std::uint32_t i = 0; i < kLeafVertices; ++i) {
        const float x[3] = {-1, 1, 0}, y[3] = {-1, -1, 1};
        const std::uint32_t k = i < 3 ? i : 0;
        leaf.vertex[i] = {x[k], y[k], 8, i == 0 ? pack_corners(0, 1, 2, 1) : 0};
        leaf.prim_id[i] = i == 0 ? 5 : kNoPrim;
    }
    bvh.nodes.resize(kMaxDepth);
    for (std::uint32_t level = 0; level < kMaxDepth; ++level) {
        Node& node = bvh.nodes[level];
        for (std::uint32_t i = 0; i < kWidth; ++i) {
            set_slot_box(node, i, {{-1, -1, 8}, {1, 1, 8}});
            set_child(node, i, i == slot && level + 1 < kMaxDepth ? level + 1 : leaf_child(0));
        }
    }
    return bvh;
}

// The first or the last of boxes that are entered at once is on top of the stack, so one of the two
// trees fills it to kMaxStack.
TEST(SingleRayTracer, HasRoomForTheDeepestTree) {
    for (const std::uint32_t slot : {0u, kWidth - 1}) {
        const Bvh bvh = deepest_chain(slot);
        for (const std::size_t count : {1, 3, 4, 8, 12, 64}) {
            // The last ray misses the triangle, and so meets every box.
            std::vector<Ray> rays(count, Ray{{0, 0, 0}, 0, {0, 0, 1}, kInfiniteT});
            rays.back().org = {0.875f, 0.875f, 0};
            for (const SimdTarget& target : supported_simd_targets()) {
                const cpu::SingleRayTracer tracer(bvh, target);
                std::vector<Hit> hits(count);
                std::vector<std::uint8_t> occluded(count, 7);
                tracer.intersect(rays, hits);
                tracer.occluded(rays, occluded);
                for (std::size_t i = 0; i < count; ++i) {
                    const bool is_hit = i + 1 < count;
                    EXPECT_EQ(hits[i].prim_id, is_hit ? 5u : kNoPrim);
                    EXPECT_EQ(hits[i].t, is_hit ? 8.0f : 0.0f);
                    EXPECT_EQ(occluded[i], is_hit ? 1 : 0);
                }
            }
        }
    }
}

// The filter of leaves may underflow; that decides nothing (cpu/single_ray/leaf-inl.h).
TEST(SingleRayTracer, RaisesNothingInvalidAndNoOverflow) {
    for (const NamedScene& named : adversarial_scenes()) {
        const TestScene& scene = named.scene;
        const Bvh bvh = build_bvh(scene.topology(), scene.positions());
        const std::vector<Ray> rays = mixed_rays(scene, 1003, 61);
        std::vector<Hit> hits(rays.size());
        std::vector<std::uint8_t> occluded(rays.size());
        for (const SimdTarget& target : supported_simd_targets()) {
            const cpu::SingleRayTracer tracer(bvh, target);
            std::feclearexcept(FE_ALL_EXCEPT);
            tracer.intersect(rays, hits);
            tracer.occluded(rays, occluded);
            for (const Ray& ray : rays) {
                tracer.intersect({&ray, 1}, {hits.data(), 1});
                tracer.occluded({&ray, 1}, {occluded.data(), 1});
            }
            EXPECT_EQ(std::fetestexcept(FE_INVALID | FE_OVERFLOW), 0)
                << named.name << ", " << target.name;
        }
    }
    std::feclearexcept(FE_ALL_EXCEPT);
}

}  // namespace
}  // namespace mray
