// The promise: what the device answers is what the CPU answers, bit for bit. The oracle is brute
// force, which shares the hit rule but no tree, no order and no batching with the device.
#include <gtest/gtest.h>

#include <bit>
#include <cstring>

#include "common/compare.h"
#include "cpu/cpu_backend.h"
#include "gpu/vulkan_backend_internal.h"
#include "tests/gpu/test_scenes.h"

namespace morphray::test {
namespace {

std::unique_ptr<Backend> device(const gpu::Tuning& tuning = {}) {
    return gpu::make_vulkan_backend({.device = "", .validate = true}, tuning);
}

bool same_bits(const Hit& a, const Hit& b) { return std::memcmp(&a, &b, sizeof(Hit)) == 0; }

std::size_t differing(const Frame& a, const Frame& b) {
    std::size_t count = a.width != b.width || a.height != b.height;
    for (std::size_t i = 0; i < a.hits.size(); ++i) {
        count += !same_bits(a.hits[i], b.hits[i]) || a.occlusion[i] != b.occlusion[i] ||
                 a.pixels[i] != b.pixels[i];
    }
    return count;
}

void expect_same_images(Backend& actual, std::uint32_t width, std::uint32_t height) {
    const std::unique_ptr<Backend> brute = cpu::make_brute_backend();
    for (const TestScene& scene : test_scenes()) {
        const Bvh bvh = plain_tree(scene);
        brute->set_scene(scene.topology, scene.positions, bvh);
        actual.set_scene(scene.topology, scene.positions, bvh);
        for (const std::uint32_t rays : {kRaysPrimary, kRaysShadow, kRaysAo}) {
            Frame expected, traced;
            brute->trace_image(view(width, height, rays), expected);
            actual.trace_image(view(width, height, rays), traced);
            EXPECT_EQ(differing(expected, traced), 0u) << scene.name << ", rays " << rays;
            EXPECT_EQ(brute->times().rays, actual.times().rays);
        }
    }
}

TEST(OnePicture, ImagesEqualBruteForce) { expect_same_images(*device(), 77, 53); }

TEST(OnePicture, ImagesInManyRegionsEqualBruteForce) {
    gpu::Tuning tuning;
    tuning.tiles_per_dispatch = 3;
    expect_same_images(*device(tuning), 61, 43);
}

TEST(OnePicture, ImagesWithASuspensionAtEveryStepEqualBruteForce) {
    gpu::Tuning tuning;
    tuning.step_budget = 1;
    tuning.resume_slots = 128;
    expect_same_images(*device(tuning), 31, 23);
}

TEST(OnePicture, ImagesWithSomeRaysSuspendedEqualBruteForce) {
    gpu::Tuning tuning;
    tuning.step_budget = 60;
    expect_same_images(*device(tuning), 61, 43);
}

TEST(OnePicture, ImagesCopiedThroughStagingEqualBruteForce) {
    gpu::Tuning tuning;
    tuning.force_staging = true;
    expect_same_images(*device(tuning), 61, 43);
}

TEST(OnePicture, BatchesOfRaysEqualBruteForce) {
    gpu::Tuning tuning;
    tuning.tiles_per_dispatch = 16;
    const std::unique_ptr<Backend> vulkan = device(tuning);
    const std::unique_ptr<Backend> brute = cpu::make_brute_backend();
    const std::vector<Ray> rays = scattered_rays(5000, 7);
    for (const TestScene& scene : test_scenes()) {
        const Bvh bvh = plain_tree(scene);
        brute->set_scene(scene.topology, scene.positions, bvh);
        vulkan->set_scene(scene.topology, scene.positions, bvh);
        std::vector<Hit> expected(rays.size()), actual(rays.size());
        brute->trace_rays(rays, expected);
        vulkan->trace_rays(rays, actual);
        std::size_t different = 0;
        for (std::size_t i = 0; i < rays.size(); ++i) {
            different += !same_bits(expected[i], actual[i]);
        }
        EXPECT_EQ(different, 0u) << scene.name;
        EXPECT_EQ(vulkan->times().rays, rays.size());
    }
}

}  // namespace
}  // namespace morphray::test
