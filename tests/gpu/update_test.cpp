// Updates on the device: a refit is deferred to the submission of the next image, and any sequence
// of updates gives the trees and images of the CPU.
#include <gtest/gtest.h>

#include <algorithm>

#include "common/image/frame.h"
#include "common/update/restructure.h"
#include "cpu/cpu_backend.h"
#include "gpu/scene_buffers.h"
#include "gpu/shared_device.h"
#include "gpu/vulkan/context.h"
#include "tests/gpu/faulty_loader.h"
#include "tests/gpu/test_scenes.h"
#include "tests/support/backend_results.h"
#include "tests/support/motion_checks.h"
#include "tests/support/motions.h"

namespace mray::test {
namespace {

constexpr int kPoses = 8;

/// Even poses move all of the scene, odd ones its first tenth.
std::vector<vec3> pose(const TestScene& scene, int number) {
    std::vector<vec3> positions = swayed(scene, 0.2f * static_cast<float>(number / 2));
    const std::vector<vec3> next = swayed(scene, 0.2f * static_cast<float>(number / 2) + 0.1f);
    if (number % 2 == 1) std::copy_n(next.begin(), positions.size() / 10, positions.begin());
    return positions;
}

/// With staging buffers are read as on a GPU, too.
std::unique_ptr<Backend> tuned_device(bool force_staging, std::uint32_t step_budget = kStepBudget) {
    const gpu::BufferKind kind =
        force_staging ? gpu::BufferKind::kStorage : gpu::BufferKind::kTexels;
    return validated_device(
        {.step_budget = step_budget, .buffer_kind = kind, .force_staging = force_staging});
}

std::vector<ImageHashes> images(Backend& backend, const TestScene& scene, const ImageParams& view) {
    MovingScene moving(backend, scene, built_tree(scene));
    std::vector<ImageHashes> images;
    for (int i = 0; i < kPoses; ++i) {
        moving.refit(pose(scene, i));
        images.push_back(image_hashes(backend, view));
    }
    return images;
}

TEST(VulkanUpdate, ImagesAfterDeferredRefitsAreThoseOfTheCpu) {
    const std::unique_ptr<Backend> cpu = cpu::make_scalar_backend();
    const TestScene scene = torus(64, 32);
    for (const bool force_staging : {false, true}) {
        // A small budget suspends rays, which are resumed after the refit's submission.
        for (const std::uint32_t step_budget : {kStepBudget, 60u}) {
            const std::unique_ptr<Backend> vulkan = tuned_device(force_staging, step_budget);
            for (const std::uint32_t rays : {kRaysPrimary, kRaysShadow, kRaysAo}) {
                const ImageParams params = view(64, 48, rays);
                EXPECT_EQ(images(*vulkan, scene, params), images(*cpu, scene, params))
                    << force_staging << ' ' << step_budget << ' ' << rays;
            }
        }
    }
}

TEST(VulkanUpdate, RefitAndImageAreOneSubmissionWithItsTimes) {
    for (const bool force_staging : {false, true}) {
        FaultyDevice device({.force_staging = force_staging});
        std::size_t& submissions = device.faults.call_count;
        device.faults.counts = [](std::string_view name) { return name == "vkQueueSubmit"; };
        Backend& vulkan = *device.backend;
        const TestScene scene = torus(64, 32);
        MovingScene moving(vulkan, scene, built_tree(scene));
        Frame frame;
        // Compiles the kernels.
        moving.refit(swayed(scene, 0.5f));
        vulkan.trace_image(view(64, 48, kRaysPrimary), frame);
        submissions = 0;
        moving.refit(swayed(scene, 1));
        EXPECT_EQ(submissions, 0u);
        vulkan.trace_image(view(64, 48, kRaysPrimary), frame);
        EXPECT_EQ(submissions, 1u);
        moving.refit(swayed(scene, 2));
        EXPECT_EQ(submissions, 1u);
        vulkan.trace_image(view(64, 48, kRaysPrimary), frame);
        EXPECT_GT(vulkan.finish().update.refit_ms, 0);
        EXPECT_GT(vulkan.finish().trace_ms, vulkan.finish().shade_ms);
        EXPECT_GT(vulkan.finish().shade_ms, 0);
        EXPECT_EQ(submissions, 2u);
    }
}

TEST(VulkanUpdate, RefitsGiveTheBytesOfTheCpuOnEveryScene) {
    const std::unique_ptr<Backend> vulkan = validated_device();
    for (const NamedScene& named : adversarial_scenes()) {
        const TestScene& scene = named.scene;
        const std::vector<vec3> nowhere(scene.positions().size(), vec3(kInvalidCoordinate));
        for (const Bvh& built : {built_tree(scene), loose_tree(scene)}) {
            Bvh expected = built;
            MovingScene moving(*vulkan, scene, built);
            for (const std::vector<vec3>& positions :
                 {swayed(scene, 1), swayed(scene, 1.5f), nowhere, scene.positions()}) {
                cpu::refit(expected, positions);
                moving.refit(positions);
                EXPECT_EQ(tree_hash(*vulkan), bvh_hash(expected)) << named.name;
            }
            EXPECT_EQ(bvh_hash(expected), bvh_hash(built)) << named.name;
        }
    }
}

TEST(VulkanUpdate, BodiesAreMovedOnTheDevice) {
    const TestScene scene = torus(64, 48);
    const std::vector<vec3> rest = scene.world_positions();
    for (const bool force_staging : {false, true}) {
        const std::unique_ptr<Backend> vulkan = tuned_device(force_staging);
        Bvh expected = built_tree(scene);
        Pose moving = scene.pose();
        vulkan->set_scene(scene.topology(), moving, expected);
        for (int step = 1; step < 6; ++step) {
            const float s = 0.1f * static_cast<float>(step);
            const Transform transform{{0.9f, -s, 0, 0.2f}, {s, 0.9f, s, 0}, {0, 0.1f, -1, -s}};
            std::vector<vec3> positions = swayed(scene, s);
            // Those of bodies cannot come from the host, which has others.
            std::vector<vec3> written = positions;
            std::vector<Body> bodies;
            for (const IndexRange range : {IndexRange{7, 1500}, {1500, 1503}, {1600, 3060}}) {
                for (std::uint32_t i = range.begin; i < range.end; ++i) {
                    positions[i] = scene.space().to_scene(transform_point(transform, rest[i]));
                    written[i] = -positions[i];
                }
                bodies.push_back({range.begin,
                                  std::span(rest).subspan(range.begin, range.end - range.begin), 1,
                                  transform, scene.space()});
            }
            moving.move_to(written);
            for (const Body& body : bodies) moving.add_body(body);
            vulkan->refit();
            cpu::refit(expected, positions);
            EXPECT_EQ(tree_hash(*vulkan), bvh_hash(expected)) << force_staging << ' ' << step;
        }
    }
}

TEST(VulkanUpdate, MovedBodiesAreLessThanAHundredthOfTheirPositions) {
    // As many vertices as a torus of 10,000 triangles has.
    constexpr std::uint32_t kBodies = 100, kVertices = 5000;
    const std::vector<vec3> rest(kVertices, vec3(1));
    Pose pose(std::vector<vec3>(std::size_t{kBodies} * kVertices, vec3(2)));
    pose.move_to(std::vector<vec3>(pose.positions().size(), vec3(3)));
    for (std::uint32_t i = 0; i < kBodies; ++i)
        pose.add_body({i * kVertices, rest, 1, Transform{}, torus(3, 3).space()});
    const auto shared = gpu::open_device({}, {});
    const gpu::PositionUpdate update =
        gpu::moved_positions(gpu::Context(shared->device, 60'000), pose);
    EXPECT_EQ(update.bodies.size(), kBodies);
    std::size_t bytes = 16 * kBodyVec4s * update.bodies.size();
    for (const IndexRange& range : update.copied) bytes += sizeof(vec3) * (range.end - range.begin);
    EXPECT_LT(bytes, sizeof(vec3) * pose.positions().size() / 100);
}

TEST(VulkanUpdate, ABackendCanEndBeforeItsRefitIsDone) {
    const std::unique_ptr<Backend> vulkan = tuned_device(false);
    const TestScene scene = torus(64, 32);
    MovingScene(*vulkan, scene, built_tree(scene)).refit(swayed(scene, 1));
}

TEST(VulkanUpdate, MixesRefitsTreesAndRestructuringsLikeTheCpu) {
    for (const bool force_staging : {false, true}) {
        const TestScene scene = torus(64, 16);
        const Bvh built = built_tree(scene);
        BuiltAreas areas = built_areas(built);
        BuiltAreas cpu_areas = areas;
        const auto cpu = cpu::make_scalar_backend();
        const auto vulkan = tuned_device(force_staging);
        Pose moving = scene.pose();
        for (Backend* backend : {vulkan.get(), cpu.get()})
            backend->set_scene(scene.topology(), moving, built);
        std::size_t edits = 0;
        Random random(1);
        for (int step = 0; step < 60; ++step) {
            const std::vector<vec3> positions =
                swayed(scene, 0.125f * static_cast<float>(random.below(40)));
            moving.move_to(positions);
            const auto act = [&](Backend& backend, BuiltAreas& its_areas, std::uint32_t what) {
                if (what == 0) {
                    const Bvh tree = build_bvh(scene.topology(), positions);
                    backend.set_tree(tree);
                    its_areas = built_areas(tree);
                } else {
                    backend.refit(what == 1 ? RefitExtent::kAll : RefitExtent::kMoved);
                }
                if (what < 3) return;
                backend.edit_tree([&](Bvh& bvh) {
                    const bool is_changed =
                        restructure(scene.topology(), positions, 1, 1, bvh, its_areas) > 0;
                    edits += is_changed;
                    return is_changed;
                });
            };
            const std::uint32_t what = random.below(6);
            act(*cpu, cpu_areas, what);
            act(*vulkan, areas, what);
            ASSERT_EQ(tree_hash(*vulkan), tree_hash(*cpu)) << step << ' ' << what;
        }
        EXPECT_GT(edits, 0u);
    }
}

TEST(HardMotionOnVulkan, GivesTheHitsOfBruteForceUnderEveryPolicy) {
    const auto vulkan = validated_device();
    const auto brute = cpu::make_brute_backend();
    for (const Motion& motion : hard_motions()) expect_hits_of_brute_force(motion, *vulkan, *brute);
}

TEST(HardMotionOnVulkan, TakesTheDecisionsOfTheCpu) {
    const auto vulkan = validated_device();
    const auto cpu = cpu::make_cpu_backend();
    for (const Motion& motion : hard_motions())
        EXPECT_EQ(counted_decisions(motion, *vulkan), counted_decisions(motion, *cpu));
}

}  // namespace
}  // namespace mray::test
