// Every tracer of the CPU goes on into boxes that begin within the depth margin behind the closest
// hit so far (docs/design/arithmetic.md, "Boxes").
#include "tests/support/late_boxes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <span>

#include "cpu/reference/scalar_tracer.h"
#include "cpu/single_ray/single_ray_tracer.h"
#include "tests/support/same_bits.h"

namespace mray {
namespace {

using namespace test;

/// The closest hits, each of which must be the first triangle's.
std::vector<Hit> true_hits(const LateBoxes& scene, std::span<const Ray> rays) {
    const cpu::BruteTracer brute(scene.topology, scene.positions);
    std::vector<Hit> hits;
    for (const Ray& ray : rays) {
        hits.push_back(brute.intersect(ray));
        EXPECT_EQ(hits.back().prim_id, 0u);
    }
    return hits;
}

/// The same rays, which end at their hits.
std::vector<Ray> rays_to_hits(std::vector<Ray> rays, std::span<const Hit> hits) {
    for (std::size_t i = 0; i < rays.size(); ++i) rays[i].tfar = hits[i].t;
    return rays;
}

TEST(LateBoxes, AreEnteredByTheScalarTracer) {
    const LateBoxes scene = late_boxes(Late::kOnAnotherAxis, 63);
    const LateBoxes all_late = late_boxes(Late::kOnAnotherAxis, kNoPrim);
    const std::vector<Ray> rays = rays_at_late_boxes(Late::kOnAnotherAxis, 500);
    const std::vector<Hit> expected = true_hits(scene, rays);
    const std::vector<Ray> ending = rays_to_hits(rays, expected);
    for (std::size_t i = 0; i < rays.size(); ++i) {
        EXPECT_TRUE(same_bits(cpu::ScalarTracer(scene.bvh).intersect(rays[i]), expected[i]));
        EXPECT_TRUE(same_bits(cpu::ScalarTracer(all_late.bvh).intersect(ending[i]), expected[i]));
        EXPECT_TRUE(cpu::ScalarTracer(all_late.bvh).occluded(ending[i]));
    }
}

TEST(LateBoxes, AreEnteredBySingleRaysOnEveryTarget) {
    const LateBoxes scene = late_boxes(Late::kOnAnotherAxis, 63);
    const LateBoxes all_late = late_boxes(Late::kOnAnotherAxis, kNoPrim);
    for (const std::size_t count : {1, 3, 8, 64, 500}) {
        const std::vector<Ray> rays = rays_at_late_boxes(Late::kOnAnotherAxis, count);
        const std::vector<Hit> expected = true_hits(scene, rays);
        const std::vector<Ray> ending = rays_to_hits(rays, expected);
        const auto equal = [](const Hit& a, const Hit& b) { return same_bits(a, b); };
        for (const SimdTarget& target : supported_simd_targets()) {
            SCOPED_TRACE(target.name);
            std::vector<Hit> hits(count);
            cpu::SingleRayTracer(scene.bvh, target).intersect(rays, hits);
            EXPECT_TRUE(std::equal(hits.begin(), hits.end(), expected.begin(), equal)) << count;
            const cpu::SingleRayTracer late_tracer(all_late.bvh, target);
            late_tracer.intersect(ending, hits);
            EXPECT_TRUE(std::equal(hits.begin(), hits.end(), expected.begin(), equal)) << count;
            std::vector<std::uint8_t> occluded(count, 0);
            late_tracer.occluded(ending, occluded);
            EXPECT_EQ(std::ranges::count(occluded, 1), std::ssize(occluded)) << count;
        }
    }
}

}  // namespace
}  // namespace mray
