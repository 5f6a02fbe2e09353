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

TEST(OnePicture, ImagesEqualBruteForce) { expect_same_images(*validated_device(), 77, 53); }

TEST(OnePicture, ImagesWithoutPacketsEqualBruteForce) {
    gpu::Tuning tuning;
    tuning.use_packets = false;
    expect_same_images(*validated_device(tuning), 61, 43);
}

// Several packets side by side and above each other, runs of packets that end within the image, and
// rays whose surface few rays of their packet share. Light packets are tall in the large image, and
// low in the small one, which has fewer pixels than triangles.
TEST(OnePicture, ImagesOfManyPacketsEqualTheCpu) {
    const std::unique_ptr<Backend> vulkan = validated_device();
    const std::unique_ptr<Backend> cpu = cpu::make_scalar_backend();
    for (const DeviceScene& scene : {torus(128, 64), debris(4000, 5), layers(3000, 2)}) {
        const Bvh bvh = build_bvh(scene.topology, scene.positions);
        for (Backend* backend : {vulkan.get(), cpu.get()}) {
            backend->set_scene(scene.topology, scene.positions, bvh);
        }
        const ImageParams views[] = {view(333, 217, kRaysPrimary), view(333, 217, kRaysShadow),
                                     view(61, 43, kRaysShadow)};
        for (const ImageParams& params : views) {
            Frame expected, traced;
            cpu->trace_image(params, expected);
            vulkan->trace_image(params, traced);
            EXPECT_EQ(differing(expected, traced), 0u)
                << scene.name << ", " << params.width << " wide, rays " << params.rays;
        }
    }
}

// Edges exclude groups of rays from triangles that have no orientation.
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

// Several packets in a subgroup take their own control flow.
TEST(OnePicture, ImagesOfSeveralPacketsASubgroupEqualBruteForce) {
    for (const std::uint32_t lanes : {4u, 8u}) {
        gpu::Tuning tuning;
        tuning.most_packet_lanes = lanes;
        expect_same_images(*validated_device(tuning), 61, 43);
    }
}

// Packets of one pixel's rays and of many pixels' rays, on surfaces that hide each other, with
// every number of lanes; and dispatches that end between the rays of a pixel.
TEST(OnePicture, AnyNumberOfOcclusionRaysGivesTheImageOfBruteForce) {
    const std::unique_ptr<Backend> brute = cpu::make_brute_backend();
    for (const std::uint32_t lanes : {4u, 8u, 16u}) {
        gpu::Tuning tuning;
        tuning.most_packet_lanes = lanes;
        tuning.tiles_per_dispatch = 30;
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
                    << scene.name << ", " << count << " rays, " << lanes << " lanes";
            }
        }
    }
}

// Rays so close to edges that all of these cases fail without the bounds of occlusion packets.
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
    expect_same_images(*validated_device(tuning), 61, 43);
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
    tuning.use_packets = false;
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
        brute->trace_rays(rays, expected);
        vulkan->trace_rays(rays, actual);
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
    gpu::Tuning single_rays;
    single_rays.use_packets = false;
    for (const gpu::Tuning& tuning : {gpu::Tuning(), single_rays}) {
        const std::unique_ptr<Backend> vulkan = validated_device(tuning);
        const std::unique_ptr<Backend> brute = cpu::make_brute_backend();
        const Late late = tuning.use_packets ? Late::kOnMainAxis : Late::kOnAnotherAxis;
        const LateBoxes scene = late_boxes(late, 63);
        for (Backend* backend : {vulkan.get(), brute.get()})
            backend->set_scene(scene.topology, scene.positions, scene.bvh);
        if (tuning.use_packets) {
            Frame expected, traced;
            brute->trace_image(view(61, 43, kRaysPrimary), expected);
            vulkan->trace_image(view(61, 43, kRaysPrimary), traced);
            EXPECT_EQ(differing(expected, traced), 0u);
            continue;
        }
        const std::vector<Ray> rays = rays_at_late_boxes(late, 1000);
        std::vector<Hit> hits(rays.size()), expected_hits(rays.size());
        vulkan->trace_rays(rays, hits);
        brute->trace_rays(rays, expected_hits);
        for (std::size_t i = 0; i < rays.size(); ++i) {
            EXPECT_EQ(expected_hits[i].prim_id, 0u);
            EXPECT_TRUE(same_bits(hits[i], expected_hits[i])) << i;
        }
    }
}

}  // namespace
}  // namespace mray::test
