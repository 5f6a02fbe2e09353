// The device gives the answers of the CPU, bit for bit. The oracle is brute force, which shares the
// hit rule with the device, but no tree, order or batching.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "common/bvh/builder/bvh_builder.h"
#include "common/image/frame.h"
#include "cpu/cpu_backend.h"
#include "tests/gpu/test_scenes.h"
#include "tests/gpu/validated_device.h"
#include "tests/support/late_boxes.h"
#include "tests/support/same_bits.h"

namespace mray::test {
namespace {

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
    for (const DeviceScene& scene : test_scenes()) {
        const Bvh bvh = plain_tree(scene);
        brute->set_scene(scene.topology, scene.positions, bvh);
        actual.set_scene(scene.topology, scene.positions, bvh);
        for (const std::uint32_t rays : {kRaysPrimary, kRaysShadow, kRaysAo}) {
            Frame expected, traced;
            brute->trace_image(view(width, height, rays), expected);
            actual.trace_image(view(width, height, rays), traced);
            EXPECT_EQ(differing(expected, traced), 0u) << scene.name << ", rays " << rays;
            EXPECT_EQ(brute->finish().rays, actual.finish().rays);
        }
    }
}

TEST(OnePicture, ImagesEqualBruteForce) {
    for (const gpu::BufferKind kind : {gpu::BufferKind::kTexels, gpu::BufferKind::kStorage})
        expect_same_images(*validated_device({.buffer_kind = kind}), 77, 53);
}

// Triangles that have no orientation as the eye and the light see them.
TEST(OnePicture, ImagesOfTrianglesThatPassLightAndEyeEqualTheCpu) {
    const std::unique_ptr<Backend> vulkan = validated_device();
    const std::unique_ptr<Backend> cpu = cpu::make_scalar_backend();
    for (const DeviceScene& scene : {beams(60, 1), beams(600, 2)}) {
        const Bvh bvh = build_bvh(scene.topology, scene.positions);
        for (Backend* backend : {vulkan.get(), cpu.get()})
            backend->set_scene(scene.topology, scene.positions, bvh);
        for (const std::uint32_t rays : {kRaysPrimary, kRaysShadow}) {
            Frame expected, traced;
            cpu->trace_image(view(233, 157, rays), expected);
            vulkan->trace_image(view(233, 157, rays), traced);
            EXPECT_EQ(differing(expected, traced), 0u) << scene.name << ", rays " << rays;
        }
    }
}

// Surfaces that hide each other, in one submission and in batches that end between the rays of a
// pixel.
TEST(OnePicture, AnyNumberOfOcclusionRaysGivesTheImageOfBruteForce) {
    const std::unique_ptr<Backend> brute = cpu::make_brute_backend();
    for (const std::uint32_t tiles : {30u, 4096u}) {
        gpu::Tuning tuning;
        tuning.tiles_per_dispatch = tiles;
        const std::unique_ptr<Backend> vulkan = validated_device(tuning);
        for (const DeviceScene& scene : {torus(32, 16), debris(700, 9)}) {
            const Bvh bvh = build_bvh(scene.topology, scene.positions);
            for (Backend* backend : {vulkan.get(), brute.get()}) {
                backend->set_scene(scene.topology, scene.positions, bvh);
            }
            for (const std::uint32_t count : {1u, 2u, 3u, 7u, 37u}) {
                Frame expected, traced;
                brute->trace_image(view(40, 30, kRaysAo, count), expected);
                vulkan->trace_image(view(40, 30, kRaysAo, count), traced);
                EXPECT_EQ(differing(expected, traced), 0u)
                    << scene.name << ", " << count << " rays, " << tiles << " tiles";
            }
        }
    }
}

// Rays so close to edges that most of them need the exact rule.
TEST(OnePicture, OcclusionRaysThatMeetEdgesEqualTheCpu) {
    const std::unique_ptr<Backend> vulkan = validated_device();
    const std::unique_ptr<Backend> cpu = cpu::make_scalar_backend();
    for (const DeviceScene& scene :
         {strips(30000, 1, 1), strips(6000, 24, 2), debris(20000, 11), layers(3000, 3)}) {
        const Bvh bvh = build_bvh(scene.topology, scene.positions);
        for (Backend* backend : {vulkan.get(), cpu.get()}) {
            backend->set_scene(scene.topology, scene.positions, bvh);
        }
        for (const std::uint32_t count : {2u, 31u}) {
            Frame expected, traced;
            cpu->trace_image(view(128, 96, kRaysAo, count), expected);
            vulkan->trace_image(view(128, 96, kRaysAo, count), traced);
            EXPECT_EQ(differing(expected, traced), 0u) << scene.name << ", " << count;
        }
    }
}

TEST(OnePicture, ImagesInManyRegionsEqualBruteForce) {
    gpu::Tuning tuning;
    tuning.tiles_per_dispatch = 3;
    expect_same_images(*validated_device(tuning), 61, 43);
}

TEST(OnePicture, ImagesWithASuspensionAtEveryStepEqualBruteForce) {
    gpu::Tuning tuning;
    tuning.step_budget = 1;
    tuning.resume_slots = 128;
    expect_same_images(*validated_device(tuning), 31, 23);
}

TEST(OnePicture, ImagesWithSomeRaysSuspendedEqualBruteForce) {
    gpu::Tuning tuning;
    tuning.step_budget = 60;
    for (const gpu::BufferKind kind : {gpu::BufferKind::kTexels, gpu::BufferKind::kStorage}) {
        tuning.buffer_kind = kind;
        expect_same_images(*validated_device(tuning), 61, 43);
    }
}

// The worst trees after deformation, with the default budget: each ray meets every triangle, which
// takes more steps than a lane has.
TEST(OnePicture, ImagesOfTreesThatCannotBeCulledEqualBruteForce) {
    const std::unique_ptr<Backend> vulkan = validated_device();
    const std::unique_ptr<Backend> brute = cpu::make_brute_backend();
    for (DeviceScene& scene : std::vector{coincident(5000), torus(64, 32)}) {
        const Bvh bvh = build_bvh(scene.topology, scene.positions);
        std::shuffle(scene.positions.begin(), scene.positions.end(), std::mt19937(1));
        for (Backend* backend : {vulkan.get(), brute.get()}) {
            backend->set_scene(scene.topology, scene.positions, bvh);
            backend->refit(scene.positions, RefitExtent::kAll);
        }
        Frame expected, traced;
        brute->trace_image(view(48, 32, kRaysShadow), expected);
        vulkan->trace_image(view(48, 32, kRaysShadow), traced);
        EXPECT_EQ(differing(expected, traced), 0u) << scene.name;
    }
}

// Each leaf is full, and each of its triangles uncertain, so that a leaf takes the most steps; the
// rounds that continue a ray are limited by their number.
TEST(OnePicture, ImagesOfFullLeavesThatCannotBeCulledEqualBruteForce) {
    gpu::Tuning tuning;
    tuning.step_budget = 100;
    const std::unique_ptr<Backend> vulkan = validated_device(tuning);
    const std::unique_ptr<Backend> brute = cpu::make_brute_backend();
    const DeviceScene scene = coincident(8192);
    const Bvh bvh = build_bvh(scene.topology, scene.positions);
    for (Backend* backend : {vulkan.get(), brute.get()})
        backend->set_scene(scene.topology, scene.positions, bvh);
    Frame expected, traced;
    brute->trace_image(view(8, 6, kRaysPrimary), expected);
    vulkan->trace_image(view(8, 6, kRaysPrimary), traced);
    EXPECT_EQ(differing(expected, traced), 0u);
}

TEST(OnePicture, ImagesCopiedThroughStagingEqualBruteForce) {
    gpu::Tuning tuning;
    tuning.force_staging = true;
    expect_same_images(*validated_device(tuning), 61, 43);
}

TEST(OnePicture, BatchesOfRaysEqualBruteForce) {
    gpu::Tuning tuning;
    tuning.tiles_per_dispatch = 16;
    const std::unique_ptr<Backend> vulkan = validated_device(tuning);
    const std::unique_ptr<Backend> brute = cpu::make_brute_backend();
    const std::vector<Ray> rays = scattered_rays(5000, 7);
    for (const DeviceScene& scene : test_scenes()) {
        const Bvh bvh = plain_tree(scene);
        brute->set_scene(scene.topology, scene.positions, bvh);
        vulkan->set_scene(scene.topology, scene.positions, bvh);
        std::vector<Hit> expected(rays.size()), actual(rays.size());
        brute->trace({rays, expected});
        vulkan->trace({rays, actual});
        std::size_t different = 0;
        for (std::size_t i = 0; i < rays.size(); ++i) {
            different += !same_bits(expected[i], actual[i]);
        }
        EXPECT_EQ(different, 0u) << scene.name;
        EXPECT_EQ(vulkan->finish().rays, rays.size());
    }
}

// Rays go on into boxes that begin within the depth margin behind the closest hit so far.
TEST(OnePicture, LateBoxesAreEntered) {
    const std::unique_ptr<Backend> vulkan = validated_device();
    const std::unique_ptr<Backend> brute = cpu::make_brute_backend();
    const LateBoxes scene = late_boxes(Late::kOnAnotherAxis, 63);
    for (Backend* backend : {vulkan.get(), brute.get()})
        backend->set_scene(scene.topology, scene.positions, scene.bvh);
    const std::vector<Ray> rays = rays_at_late_boxes(Late::kOnAnotherAxis, 1000);
    std::vector<Hit> hits(rays.size()), expected_hits(rays.size());
    vulkan->trace({rays, hits});
    brute->trace({rays, expected_hits});
    for (std::size_t i = 0; i < rays.size(); ++i) {
        EXPECT_EQ(expected_hits[i].prim_id, 0u);
        EXPECT_TRUE(same_bits(hits[i], expected_hits[i])) << i;
    }
}

}  // namespace
}  // namespace mray::test
