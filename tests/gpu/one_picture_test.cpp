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

/// Compares images of a scene. `refits` also lets both backends refit all of it.
void expect_same_images(Backend& expected, Backend& actual, const DeviceScene& scene,
                        const Bvh& bvh, const std::vector<ImageParams>& views,
                        bool refits = false) {
    for (Backend* backend : {&expected, &actual}) {
        backend->set_scene(scene.topology, scene.positions, bvh);
        if (refits) backend->refit(scene.positions, RefitExtent::kAll);
    }
    for (const ImageParams& params : views) {
        SCOPED_TRACE(testing::Message() << scene.name << ", rays " << params.rays << ", "
                                        << params.ao_count << " a hit");
        Frame frame, traced;
        expected.trace_image(params, frame);
        actual.trace_image(params, traced);
        EXPECT_EQ(differing(frame, traced), 0u);
        EXPECT_EQ(expected.finish().rays, actual.finish().rays);
    }
}

void expect_images_of_brute_force(const gpu::Tuning& tuning, std::uint32_t width,
                                  std::uint32_t height) {
    const std::unique_ptr<Backend> brute = cpu::make_brute_backend();
    const std::unique_ptr<Backend> vulkan = validated_device(tuning);
    for (const DeviceScene& scene : test_scenes()) {
        expect_same_images(*brute, *vulkan, scene, plain_tree(scene),
                           {view(width, height, kRaysPrimary), view(width, height, kRaysShadow),
                            view(width, height, kRaysAo)});
    }
}

TEST(OnePicture, ImagesEqualBruteForce) {
    for (const gpu::BufferKind kind : {gpu::BufferKind::kTexels, gpu::BufferKind::kStorage})
        expect_images_of_brute_force({.buffer_kind = kind}, 77, 53);
}

TEST(OnePicture, ImagesInManyRegionsEqualBruteForce) {
    expect_images_of_brute_force({.tiles_per_dispatch = 3}, 61, 43);
}

TEST(OnePicture, ImagesWithASuspensionAtEveryStepEqualBruteForce) {
    expect_images_of_brute_force({.step_budget = 1, .resume_slots = 128}, 31, 23);
}

TEST(OnePicture, ImagesWithSomeRaysSuspendedEqualBruteForce) {
    for (const gpu::BufferKind kind : {gpu::BufferKind::kTexels, gpu::BufferKind::kStorage})
        expect_images_of_brute_force({.step_budget = 60, .buffer_kind = kind}, 61, 43);
}

TEST(OnePicture, ImagesCopiedThroughStagingEqualBruteForce) {
    expect_images_of_brute_force({.force_staging = true}, 61, 43);
}

// Triangles that have no orientation as the eye and the light see them.
TEST(OnePicture, ImagesOfTrianglesThatPassLightAndEyeEqualTheCpu) {
    const std::unique_ptr<Backend> vulkan = validated_device();
    const std::unique_ptr<Backend> cpu = cpu::make_scalar_backend();
    for (const DeviceScene& scene : {beams(60, 1), beams(600, 2)}) {
        expect_same_images(*cpu, *vulkan, scene, build_bvh(scene.topology, scene.positions),
                           {view(233, 157, kRaysPrimary), view(233, 157, kRaysShadow)});
    }
}

// Surfaces that hide each other, in one submission and in batches that end between the rays of a
// pixel.
TEST(OnePicture, AnyNumberOfOcclusionRaysGivesTheImageOfBruteForce) {
    const std::unique_ptr<Backend> brute = cpu::make_brute_backend();
    std::vector<ImageParams> views;
    for (const std::uint32_t count : {1u, 2u, 3u, 7u, 37u})
        views.push_back(view(40, 30, kRaysAo, count));
    for (const std::uint32_t tiles : {30u, 4096u}) {
        const std::unique_ptr<Backend> vulkan = validated_device({.tiles_per_dispatch = tiles});
        for (const DeviceScene& scene : {torus(32, 16), debris(700, 9)}) {
            expect_same_images(*brute, *vulkan, scene, build_bvh(scene.topology, scene.positions),
                               views);
        }
    }
}

// Rays so close to edges that most of them need the exact rule.
TEST(OnePicture, OcclusionRaysThatMeetEdgesEqualTheCpu) {
    const std::unique_ptr<Backend> vulkan = validated_device();
    const std::unique_ptr<Backend> cpu = cpu::make_scalar_backend();
    for (const DeviceScene& scene :
         {strips(30000, 1, 1), strips(6000, 24, 2), debris(20000, 11), layers(3000, 3)}) {
        expect_same_images(*cpu, *vulkan, scene, build_bvh(scene.topology, scene.positions),
                           {view(128, 96, kRaysAo, 2), view(128, 96, kRaysAo, 31)});
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
        expect_same_images(*brute, *vulkan, scene, bvh, {view(48, 32, kRaysShadow)}, true);
    }
}

// Each leaf is full, and each of its triangles uncertain, so that a leaf takes the most steps; the
// rounds that continue a ray are limited by their number.
TEST(OnePicture, ImagesOfFullLeavesThatCannotBeCulledEqualBruteForce) {
    const std::unique_ptr<Backend> vulkan = validated_device({.step_budget = 100});
    const std::unique_ptr<Backend> brute = cpu::make_brute_backend();
    const DeviceScene scene = coincident(8192);
    expect_same_images(*brute, *vulkan, scene, build_bvh(scene.topology, scene.positions),
                       {view(8, 6, kRaysPrimary)});
}

void expect_same_hits(Backend& expected, Backend& actual, std::span<const Ray> rays) {
    std::vector<Hit> hits(rays.size()), traced(rays.size());
    expected.trace({rays, hits});
    actual.trace({rays, traced});
    for (std::size_t i = 0; i < rays.size(); ++i) ASSERT_TRUE(same_bits(hits[i], traced[i])) << i;
    EXPECT_EQ(actual.finish().rays, rays.size());
}

TEST(OnePicture, BatchesOfRaysEqualBruteForce) {
    const std::unique_ptr<Backend> vulkan = validated_device({.tiles_per_dispatch = 16});
    const std::unique_ptr<Backend> brute = cpu::make_brute_backend();
    const std::vector<Ray> rays = scattered_rays(5000, 7);
    for (const DeviceScene& scene : test_scenes()) {
        SCOPED_TRACE(scene.name);
        const Bvh bvh = plain_tree(scene);
        for (Backend* backend : {vulkan.get(), brute.get()})
            backend->set_scene(scene.topology, scene.positions, bvh);
        expect_same_hits(*brute, *vulkan, rays);
    }
}

// Rays go on into boxes that begin within the depth margin behind the closest hit so far.
TEST(OnePicture, LateBoxesAreEntered) {
    const std::unique_ptr<Backend> vulkan = validated_device();
    const std::unique_ptr<Backend> brute = cpu::make_brute_backend();
    const LateBoxes scene = late_boxes(Late::kOnAnotherAxis, 63);
    for (Backend* backend : {vulkan.get(), brute.get()})
        backend->set_scene(scene.topology, scene.positions, scene.bvh);
    expect_same_hits(*brute, *vulkan, rays_at_late_boxes(Late::kOnAnotherAxis, 1000));
}

}  // namespace
}  // namespace mray::test
