#include "cpu/single_ray/single_ray_tracer.h"

#include <gtest/gtest.h>
#include <xmmintrin.h>

#include <vector>

#include "common/bvh/builder/bvh_builder.h"
#include "cpu/reference/scalar_tracer.h"
#include "tests/support/same_bits.h"
#include "tests/support/test_scene.h"

namespace mray {
namespace {

using namespace test;

TEST(SingleRayTracer, HasTheBitsOfTheScalarTracerOnEveryTarget) {
    for (const NamedScene& named : adversarial_scenes()) {
        const TestScene& scene = named.scene;
        const Bvh bvh = build_bvh(scene.topology(), scene.positions());
        const std::vector<Ray> rays = mixed_rays(scene, 4000, 17);
        const cpu::ScalarTracer scalar(bvh);
        std::vector<Hit> expected;
        std::vector<std::uint8_t> expected_occluded;
        for (const Ray& ray : rays) {
            expected.push_back(scalar.intersect(ray));
            expected_occluded.push_back(scalar.occluded(ray));
        }
        for (const SimdTarget& target : supported_simd_targets()) {
            const cpu::SingleRayTracer tracer(bvh, target);
            std::vector<Hit> hits(rays.size());
            std::vector<std::uint8_t> occluded(rays.size(), 7);
            tracer.intersect(rays, hits);
            tracer.occluded(rays, occluded);
            std::size_t different = 0;
            for (std::size_t i = 0; i < rays.size(); ++i) {
                different += !same_bits(hits[i], expected[i]);
            }
            EXPECT_EQ(different, 0u) << named.name << ", " << target.name;
            EXPECT_EQ(occluded, expected_occluded) << named.name << ", " << target.name;
        }
    }
}

TEST(SingleRayTracer, AnswersABatchOfAnySizeAndNothingBesides) {
    const TestScene scene = random_soup(400, 0.3, 7);
    const Bvh bvh = build_bvh(scene.topology(), scene.positions());
    const std::vector<Ray> rays = mixed_rays(scene, 70, 3);
    const cpu::ScalarTracer scalar(bvh);
    const Hit untouched{-1, -2, -3, 77};
    for (const SimdTarget& target : supported_simd_targets()) {
        const cpu::SingleRayTracer tracer(bvh, target);
        for (const std::size_t size : {0, 1, 2, 3, 7, 16, 17, 33, 64, 70}) {
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

// The filter of leaves may underflow; that decides nothing (cpu/single_ray/leaf_lanes-inl.h).
TEST(SingleRayTracer, RaisesNothingInvalidAndNoOverflow) {
    const unsigned before = _mm_getcsr();
    for (const NamedScene& named : adversarial_scenes()) {
        const TestScene& scene = named.scene;
        const Bvh bvh = build_bvh(scene.topology(), scene.positions());
        const std::vector<Ray> rays = mixed_rays(scene, 1003, 61);
        std::vector<Hit> hits(rays.size());
        std::vector<std::uint8_t> occluded(rays.size());
        for (const SimdTarget& target : supported_simd_targets()) {
            const cpu::SingleRayTracer tracer(bvh, target);
            _mm_setcsr(before & ~0x3Fu);
            tracer.intersect(rays, hits);
            tracer.occluded(rays, occluded);
            EXPECT_EQ(_mm_getcsr() & (_MM_EXCEPT_INVALID | _MM_EXCEPT_OVERFLOW), 0u)
                << named.name << ", " << target.name;
        }
    }
    _mm_setcsr(before);
}

}  // namespace
}  // namespace mray
