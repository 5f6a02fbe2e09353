// An update and its image are one submission, and the next pose can be handed over meanwhile.
#include <gtest/gtest.h>

#include "common/base/errors.h"
#include "common/bvh/bvh_builder.h"
#include "common/image/frame.h"
#include "cpu/cpu_backend.h"
#include "gpu/vulkan_backend_internal.h"
#include "tests/gpu/faulty_loader.h"
#include "tests/gpu/test_scenes.h"

namespace morphray::test {
namespace {

constexpr int kPoses = 8;

/// Half of the time all of the scene moves, otherwise the first tenth of it.
std::vector<vec3> pose(const TestScene& scene, int number) {
    std::vector<vec3> positions = swayed(scene, 0.2f * static_cast<float>(number / 2));
    const std::vector<vec3> next = swayed(scene, 0.2f * static_cast<float>(number / 2) + 0.1f);
    if (number % 2 == 1) std::copy_n(next.begin(), positions.size() / 10, positions.begin());
    return positions;
}

struct Hashes {
    std::uint64_t hits;
    std::uint64_t image;
    bool operator==(const Hashes&) const = default;
};

Hashes hashes(const Frame& frame) { return {hits_hash(frame), image_hash(frame)}; }

std::vector<Hashes> one_by_one(Backend& backend, const TestScene& scene, const ImageParams& view) {
    std::vector<Hashes> images;
    for (int i = 0; i < kPoses; ++i) {
        backend.refit(pose(scene, i));
        Frame frame;
        backend.trace_image(view, frame);
        images.push_back(hashes(frame));
    }
    return images;
}

std::vector<Hashes> overlapping(Backend& backend, const TestScene& scene, const ImageParams& view) {
    Frame frames[2];
    std::vector<Hashes> images;
    for (int i = 0; i < kPoses; ++i) {
        backend.refit(pose(scene, i));
        backend.begin_image(view, frames[i % 2]);
        if (i > 0) images.push_back(hashes(frames[(i + 1) % 2]));
    }
    backend.finish();
    images.push_back(hashes(frames[(kPoses + 1) % 2]));
    return images;
}

TEST(InFlight, ImagesOfPosesHandedOverMeanwhileAreThoseOfTheCpu) {
    const std::unique_ptr<Backend> cpu = cpu::make_scalar_backend();
    const TestScene scene = torus(64, 32);
    const Bvh bvh = build_bvh(scene.topology, scene.positions);
    for (const bool force_staging : {false, true}) {
        // Rays that are suspended are traced on while the next pose waits.
        for (const std::uint32_t step_budget : {kStepBudget, 60u}) {
            gpu::Tuning tuning;
            tuning.force_staging = force_staging;
            tuning.step_budget = step_budget;
            const std::unique_ptr<Backend> vulkan =
                gpu::make_vulkan_backend({.device = "", .validate = true}, tuning);
            for (const std::uint32_t rays : {kRaysPrimary, kRaysShadow, kRaysAo}) {
                for (Backend* backend : {vulkan.get(), cpu.get()}) {
                    backend->set_scene(scene.topology, scene.positions, bvh);
                }
                const ImageParams params = view(64, 48, rays);
                EXPECT_EQ(overlapping(*vulkan, scene, params), one_by_one(*cpu, scene, params))
                    << force_staging << ' ' << step_budget << ' ' << rays;
            }
        }
    }
}

TEST(InFlight, UpdateAndImageAreOneSubmissionWithItsTimes) {
    for (const bool force_staging : {false, true}) {
        Faults faults;
        faults.counts = [](std::string_view name) { return name == "vkQueueSubmit"; };
        const FaultyLoader loader(faults);
        gpu::Tuning tuning;
        tuning.loader = loader.get();
        tuning.force_staging = force_staging;
        const std::unique_ptr<Backend> vulkan = gpu::make_vulkan_backend({}, tuning);
        const TestScene scene = torus(64, 32);
        vulkan->set_scene(scene.topology, scene.positions, plain_tree(scene));
        Frame frame;
        // Hits and pixels, where the host does not see them.
        const std::size_t copies = force_staging ? 2 : 0;
        faults.call_count = 0;
        vulkan->refit(swayed(scene, 1));
        EXPECT_EQ(faults.call_count, 0u);
        vulkan->begin_image(view(64, 48, kRaysPrimary), frame);
        EXPECT_EQ(faults.call_count, 1u);
        vulkan->refit(swayed(scene, 2));
        EXPECT_EQ(faults.call_count, 1u);
        vulkan->begin_image(view(64, 48, kRaysPrimary), frame);
        EXPECT_EQ(faults.call_count, 2 + copies);
        EXPECT_GT(vulkan->times().refit_ms, 0);
        EXPECT_GT(vulkan->times().trace_ms, vulkan->times().shade_ms);
        EXPECT_GT(vulkan->times().shade_ms, 0);
        EXPECT_EQ(faults.call_count, 2 + 2 * copies);
    }
}

TEST(InFlight, ARefitThatFailsIsMadeUpForByTheNext) {
    Faults faults;
    const FaultyLoader loader(faults);
    gpu::Tuning tuning;
    tuning.loader = loader.get();
    tuning.force_staging = true;
    const std::unique_ptr<Backend> vulkan = gpu::make_vulkan_backend({}, tuning);
    const TestScene scene = torus(64, 32);
    const Bvh bvh = build_bvh(scene.topology, scene.positions);
    const std::unique_ptr<Backend> cpu = cpu::make_scalar_backend();
    cpu->set_scene(scene.topology, scene.positions, bvh);
    cpu->refit(pose(scene, 3));
    Bvh expected, actual;
    cpu->read_bvh(expected);
    for (std::size_t k = 0; k < 20; ++k) {
        vulkan->set_scene(scene.topology, scene.positions, bvh);
        faults.fail_at = faults.call_count + k;
        try {
            vulkan->refit(pose(scene, 2));
            vulkan->finish();
        } catch (const Error&) {
        }
        faults.fail_at = Faults::kNever;
        vulkan->refit(pose(scene, 3));
        vulkan->read_bvh(actual);
        EXPECT_EQ(bvh_hash(actual), bvh_hash(expected)) << k;
    }
}

TEST(InFlight, ABackendCanEndBeforeItsImageDoes) {
    const std::unique_ptr<Backend> vulkan =
        gpu::make_vulkan_backend({.device = "", .validate = true});
    const TestScene scene = torus(64, 32);
    vulkan->set_scene(scene.topology, scene.positions, plain_tree(scene));
    Frame frame;
    vulkan->refit(swayed(scene, 1));
    vulkan->begin_image(view(64, 48, kRaysShadow), frame);
    vulkan->refit(swayed(scene, 2));
}

}  // namespace
}  // namespace morphray::test
