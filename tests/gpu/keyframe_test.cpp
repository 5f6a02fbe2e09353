// Poses between keyframes that the device interpolates are those of the host, in every byte.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "common/base/errors.h"
#include "common/bvh/bvh_builder.h"
#include "common/update/tree_updater.h"
#include "cpu/cpu_backend.h"
#include "gpu/vulkan_backend_internal.h"
#include "tests/gpu/faulty_loader.h"
#include "tests/gpu/keyframe_scene.h"

namespace morphray::test {
namespace {

std::unique_ptr<Backend> device(bool force_staging) {
    gpu::Tuning tuning;
    tuning.force_staging = force_staging;
    tuning.force_interpolation = true;
    return gpu::make_vulkan_backend({.device = "", .validate = true}, tuning);
}

std::uint64_t tree_hash(Backend& backend) {
    Bvh tree;
    backend.read_bvh(tree);
    return bvh_hash(tree);
}

/// In small and large steps, back and forth, on keyframes and next to them, and some frames twice.
constexpr double kFrames[] = {0,   0.25, 0.5, 0.75, 1,    1.25,     2,   2.5,  2.5, 4.9,  0.1,
                              0.9, 3,    3,   3.5,  2.75, 1 + 1e-6, 0.5, 1e-9, 0,   4.75, 5};

void expect_poses_of_the_host(Backend& vulkan, KeyframeScene& frames) {
    const Bvh built = build_bvh(frames.topology(), frames.positions(0));
    const auto cpu = cpu::make_scalar_backend();
    for (Backend* backend : {&vulkan, cpu.get()})
        backend->set_scene(frames.topology(), frames.positions(0), built);
    for (const double frame : kFrames) {
        Pose pose = frames.pose(frame);
        vulkan.refit_to(pose);
        cpu->refit(frames.positions(frame));
        ASSERT_EQ(tree_hash(vulkan), tree_hash(*cpu)) << frame;
    }
}

TEST(KeyframesOnVulkan, GiveTheBytesOfTheHostForEveryKindOfScene) {
    for (const bool force_staging : {false, true}) {
        const auto vulkan = device(force_staging);
        for (const TestScene& scene : test_scenes()) {
            if (scene.positions.empty()) continue;
            for (const float off : {0.0f, 100.0f, -1e5f}) {
                SCOPED_TRACE(scene.name);
                const auto frames = swaying(scene, off);
                expect_poses_of_the_host(*vulkan, *frames);
                EXPECT_TRUE(vulkan->interpolates());
            }
        }
    }
}

TEST(KeyframesOnVulkan, GiveImagesOfTheHost) {
    const TestScene scene = torus(32, 16);
    const auto frames = swaying(scene);
    const Bvh built = build_bvh(frames->topology(), frames->positions(0));
    const auto cpu = cpu::make_scalar_backend();
    const auto vulkan = device(true);
    for (Backend* backend : {vulkan.get(), cpu.get()})
        backend->set_scene(frames->topology(), frames->positions(0), built);
    for (const std::uint32_t rays : {kRaysPrimary, kRaysShadow, kRaysAo}) {
        for (const double frame : {0.5, 1.0, 3.25}) {
            Frame expected, actual;
            cpu->refit(frames->positions(frame));
            cpu->trace_image(view(64, 48, rays), expected);
            Pose pose = frames->pose(frame);
            vulkan->refit_to(pose);
            vulkan->trace_image(view(64, 48, rays), actual);
            EXPECT_EQ(hits_hash(actual), hits_hash(expected)) << frame;
            EXPECT_EQ(image_hash(actual), image_hash(expected)) << frame;
        }
    }
}

TEST(KeyframesOnVulkan, MixWithPosesTreesAndRestructurings) {
    for (const bool force_staging : {false, true}) {
        const TestScene scene = torus(64, 16);
        const auto frames = swaying(scene);
        const Bvh built = build_bvh(frames->topology(), frames->positions(0));
        BuiltAreas areas = built_areas(built);
        BuiltAreas cpu_areas = areas;
        const auto cpu = cpu::make_scalar_backend();
        const auto vulkan = device(force_staging);
        for (Backend* backend : {vulkan.get(), cpu.get()})
            backend->set_scene(frames->topology(), frames->positions(0), built);
        std::mt19937 random(1);
        for (int step = 0; step < 60; ++step) {
            const double frame = 0.125 * static_cast<double>(random() % (8 * (kKeyframes - 1) + 1));
            Pose pose = frames->pose(frame);
            const auto act = [&](Backend& backend, BuiltAreas& its_areas, std::uint32_t what) {
                if (what == 0) {
                    backend.refit(pose.positions());
                } else if (what == 1) {
                    const std::span<const vec3> positions = pose.positions();
                    const Bvh tree = build_bvh(frames->topology(), positions);
                    backend.set_frame(positions, tree);
                    its_areas = built_areas(tree);
                } else {
                    backend.refit_to(pose, what == 2 ? RefitExtent::kAll : RefitExtent::kMoved);
                }
                if (what == 3) backend.restructure(frames->topology(), 1, its_areas);
            };
            const auto what = static_cast<std::uint32_t>(random() % 6);
            act(*cpu, cpu_areas, what);
            act(*vulkan, areas, what);
            ASSERT_EQ(tree_hash(*vulkan), tree_hash(*cpu)) << step << ' ' << what << ' ' << frame;
        }
    }
}

TEST(KeyframesOnVulkan, NeedNoPositionsFromTheHostAndNoWorkWhereNothingMoves) {
    const TestScene scene = torus(16, 8);
    const auto frames = swaying(scene);
    const auto vulkan = device(true);
    const Bvh built = build_bvh(frames->topology(), frames->positions(0));
    vulkan->set_scene(frames->topology(), frames->positions(0), built);
    const int made = frames->made_count();
    for (const double frame : {0.5, 0.75, 1.0, 1.5, 2.0, 0.25}) {
        Pose pose = frames->pose(frame);
        EXPECT_EQ(vulkan->refit_to(pose), built.leaves.size());
        EXPECT_EQ(vulkan->refit_to(pose), 0u);
        EXPECT_EQ(vulkan->times().refitted_leaves, 0u);
    }
    EXPECT_EQ(frames->made_count(), made);
    // A keyframe of its own goes up as a pose.
    Pose keyframe = frames->pose(4);
    vulkan->refit_to(keyframe);
    EXPECT_EQ(frames->made_count(), made + 1);
}

/// Whether a backend interpolates; the bytes are the host's in any case.
bool interpolates(const gpu::Tuning& tuning, KeyframeScene& frames) {
    const auto vulkan = gpu::make_vulkan_backend({}, tuning);
    const auto cpu = cpu::make_scalar_backend();
    const Bvh built = build_bvh(frames.topology(), frames.positions(0));
    for (Backend* backend : {vulkan.get(), cpu.get()})
        backend->set_scene(frames.topology(), frames.positions(0), built);
    Pose pose = frames.pose(0.5);
    vulkan->refit_to(pose);
    cpu->refit(frames.positions(0.5));
    EXPECT_EQ(tree_hash(*vulkan), tree_hash(*cpu));
    return vulkan->interpolates();
}

TEST(KeyframesOnVulkan, AreLeftToTheHostWhereTheyDoNotFit) {
    TestScene scene = torus(16, 8);
    // Vertices of no triangle: few leaves, many positions.
    scene.positions.resize(20'000, vec3(0));
    const auto frames = swaying(scene);
    EXPECT_TRUE(interpolates({.force_staging = true}, *frames));
    Faults faults;
    faults.edit_properties = [](VkPhysicalDeviceProperties& p) {
        p.limits.maxTexelBufferElements = 65536;
    };
    const FaultyLoader loader(faults);
    EXPECT_FALSE(interpolates({.force_staging = true, .loader = loader.get()}, *frames));
}

TEST(KeyframesOnVulkan, UpdateAndImageAreOneSubmissionThatNothingWaitsFor) {
    Faults faults;
    faults.counts = [](std::string_view name) { return name == "vkQueueSubmit"; };
    const FaultyLoader loader(faults);
    gpu::Tuning tuning;
    tuning.loader = loader.get();
    tuning.force_interpolation = true;
    const auto vulkan = gpu::make_vulkan_backend({}, tuning);
    const TestScene scene = torus(64, 32);
    const auto frames = swaying(scene);
    vulkan->set_scene(frames->topology(), frames->positions(0),
                      build_bvh(frames->topology(), frames->positions(0)));
    Frame frame;
    std::size_t submissions = 0;
    for (const double number : {0.25, 0.5, 0.75}) {
        Pose pose = frames->pose(number);
        vulkan->refit_to(pose);
        if (number == 0.25) faults.call_count = 0;
        EXPECT_EQ(faults.call_count, submissions);
        vulkan->begin_image(view(64, 48, kRaysPrimary), frame);
        EXPECT_EQ(faults.call_count, ++submissions);
    }
    EXPECT_GT(vulkan->times().refit_ms, 0);
}

TEST(KeyframesOnVulkan, ImagesOfPosesHandedOverMeanwhileAreThoseOfTheCpu) {
    const TestScene scene = torus(48, 24);
    const auto frames = swaying(scene);
    const Bvh built = build_bvh(frames->topology(), frames->positions(0));
    const auto cpu = cpu::make_scalar_backend();
    cpu->set_scene(frames->topology(), frames->positions(0), built);
    for (const bool force_staging : {false, true}) {
        const auto vulkan = device(force_staging);
        vulkan->set_scene(frames->topology(), frames->positions(0), built);
        Frame images[2];
        const ImageParams params = view(64, 48, kRaysShadow);
        const auto expect_image = [&](std::size_t i) {
            Frame expected;
            cpu->refit(frames->positions(kFrames[i]));
            cpu->trace_image(params, expected);
            EXPECT_EQ(hits_hash(images[i % 2]), hits_hash(expected)) << kFrames[i];
            EXPECT_EQ(image_hash(images[i % 2]), image_hash(expected)) << kFrames[i];
        };
        for (std::size_t i = 0; i < std::size(kFrames); ++i) {
            // Every fifth as positions.
            Pose pose = frames->pose(kFrames[i]);
            if (i % 5 == 4) {
                vulkan->refit(pose.positions());
            } else {
                vulkan->refit_to(pose);
            }
            vulkan->begin_image(params, images[i % 2]);
            if (i > 0) expect_image(i - 1);
        }
        vulkan->finish();
        expect_image(std::size(kFrames) - 1);
    }
}

std::vector<std::string> steps(KeyframeScene& frames, Backend& tracer, const std::string& policy) {
    const UpdateConfig config{.deterministic = true, .budget = 0.02};
    TreeUpdater updater(frames.topology(), frames.positions(0), tracer, nullptr,
                        make_update_policy(policy, config), {}, config);
    std::vector<std::string> taken;
    for (const double frame : kFrames) {
        Pose pose = frames.pose(frame);
        if (updater.needs_positions()) pose.positions();
        updater.update(pose);
        Frame image;
        tracer.trace_image(view(32, 24, kRaysPrimary), image);
        updater.frame_done();
        taken.push_back(name_of(updater.last().step) + (' ' + updater.last().reason) + ' ' +
                        std::to_string(bvh_hash(updater.tree())) + ' ' +
                        std::to_string(hits_hash(image)));
    }
    return taken;
}

TEST(KeyframesOnVulkan, TakeTheStepsOfTheCpuUnderEveryPolicy) {
    const TestScene scene = torus(32, 16);
    const auto frames = swaying(scene);
    const auto vulkan = device(true);
    const auto cpu = cpu::make_scalar_backend();
    for (const char* policy : {"refit", "rebuild", "every:3", "auto"})
        EXPECT_EQ(steps(*frames, *vulkan, policy), steps(*frames, *cpu, policy)) << policy;
}

/// Updates and images, with a failure at each call in turn; afterwards the last image comes out
/// whole.
void fail_each_call(bool force_staging, bool with_new_scene) {
    Faults faults;
    const FaultyLoader loader(faults);
    gpu::Tuning tuning;
    tuning.loader = loader.get();
    tuning.force_staging = force_staging;
    tuning.force_interpolation = true;
    tuning.use_packets = false;
    const auto vulkan = gpu::make_vulkan_backend({}, tuning);
    const auto cpu = cpu::make_scalar_backend();
    const TestScene scene = torus(12, 8);
    const auto frames = swaying(scene);
    const Bvh built = build_bvh(frames->topology(), frames->positions(0));
    const ImageParams params = view(32, 32, kRaysShadow);
    Frame expected;
    for (Backend* backend : {vulkan.get(), cpu.get()})
        backend->set_scene(frames->topology(), frames->positions(0), built);
    cpu->refit(frames->positions(2.5));
    cpu->trace_image(params, expected);
    bool has_failed = true;
    std::size_t k = 0;
    for (; has_failed; ++k) {
        ASSERT_LT(k, 1000u);
        if (with_new_scene) vulkan->set_scene(frames->topology(), frames->positions(0), built);
        faults.fail_at = faults.call_count + k;
        has_failed = false;
        bool was_told = false;
        Frame image;
        Pose last = frames->pose(2.5);
        try {
            for (const double frame : {0.5, 1.5, 0.25}) {
                Pose pose = frames->pose(frame);
                vulkan->refit_to(pose);
                vulkan->begin_image(params, image);
            }
            vulkan->refit_to(last);
            was_told = true;
            vulkan->trace_image(params, image);
        } catch (const Error&) {
            has_failed = true;
        }
        faults.fail_at = Faults::kNever;
        if (!was_told) vulkan->refit_to(last);
        Frame again;
        vulkan->trace_image(params, again);
        ASSERT_EQ(hits_hash(again), hits_hash(expected)) << k;
        ASSERT_EQ(image_hash(again), image_hash(expected)) << k;
    }
    EXPECT_GT(k, 10u);
}

TEST(KeyframesOnVulkan, MayFailAtAnyCallAndBeMadeAgain) {
    for (const bool force_staging : {false, true}) {
        for (const bool with_new_scene : {false, true})
            fail_each_call(force_staging, with_new_scene);
    }
}

}  // namespace
}  // namespace morphray::test
