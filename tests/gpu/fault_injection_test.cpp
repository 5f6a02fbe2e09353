// Every Vulkan call that fails gives an Error of the right kind, and nothing leaks (which the
// address sanitizer checks).
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <optional>

#include "common/base/errors.h"
#include "gpu/shared_device.h"
#include "gpu/vulkan/vulkan_api.h"
#include "tests/gpu/faulty_loader.h"
#include "tests/gpu/test_scenes.h"
#include "tests/support/backend_results.h"
#include "tests/support/thrown_error.h"

namespace mray::test {
namespace {

/// A session that uses everything once, in dispatches of one tile.
void run_session(const FaultyLoader& loader, bool force_staging) {
    gpu::Tuning tuning = {.step_budget = 20,
                          .tiles_per_dispatch = 16,
                          .force_staging = force_staging,
                          .loader = loader.get()};
    if (force_staging) tuning.buffer_kind = gpu::BufferKind::kStorage;
    const std::unique_ptr<Backend> backend = gpu::make_vulkan_backend({}, tuning);
    const TestScene scene = torus(12, 8);
    Bvh bvh = built_tree(scene);
    MovingScene moving(*backend, scene, bvh);
    moving.refit(swayed(scene, 1));
    Frame frame;
    backend->trace_image(view(16, 16, kRaysShadow), frame);
    std::vector<Hit> hits(64);
    backend->trace({mixed_rays(scene, 64, 1), hits});
    backend->read_tree(bvh);
}

/// The error at the end of a session with these faults.
std::optional<Error> session_error(Faults& faults, bool force_staging = false) {
    const FaultyLoader loader(faults);
    return error_of([&] { run_session(loader, force_staging); });
}

// Six calls of each function: a session compiles its kernels again for each failure. In other tests
// every call of a scene and of a frame fails.
TEST(FaultInjection, FirstCallsOfEachFunctionAndEverySubmissionGiveErrorsOfTheirKind) {
    for (const bool loses_device : {false, true}) {
        std::size_t failures = 0;
        for (;; ++failures) {
            std::map<std::string_view, std::size_t> calls;
            Faults faults;
            faults.counts = [&](std::string_view name) {
                return loses_device ? name == "vkQueueSubmit" : calls[name]++ < 6;
            };
            faults.fail_at = failures;
            if (loses_device) faults.result = VK_ERROR_DEVICE_LOST;
            const std::optional<Error> error = session_error(faults, loses_device);
            ASSERT_EQ(error.has_value(), !faults.failed_name.empty()) << faults.failed_name;
            if (!error) break;
            ASSERT_LT(failures, 10000u);
            EXPECT_EQ(error->kind(), gpu::error_kind_of(faults.result))
                << faults.failed_name << ": " << error->what();
        }
        EXPECT_GT(failures, 20u);
    }
}

TEST(FaultInjection, EachKindOfFailureHasItsErrorKind) {
    const struct {
        const char* call;
        VkResult result;
        ErrorKind kind;
    } cases[] = {
        {"vkAllocateMemory", VK_ERROR_OUT_OF_DEVICE_MEMORY, ErrorKind::kLimit},
        {"vkAllocateMemory", VK_ERROR_OUT_OF_HOST_MEMORY, ErrorKind::kLimit},
        {"vkGetQueryPoolResults", VK_ERROR_DEVICE_LOST, ErrorKind::kDeviceLost},
        {"vkQueueSubmit", VK_ERROR_DEVICE_LOST, ErrorKind::kDeviceLost},
        {"vkWaitForFences", VK_ERROR_DEVICE_LOST, ErrorKind::kDeviceLost},
        {"vkCreateComputePipelines", VK_ERROR_INVALID_SHADER_NV, ErrorKind::kInternal},
        {"vkCreateDevice", VK_ERROR_FEATURE_NOT_PRESENT, ErrorKind::kUnavailable},
        {"vkCreateDevice", VK_ERROR_INITIALIZATION_FAILED, ErrorKind::kUnavailable},
        {"vkCreateInstance", VK_ERROR_INCOMPATIBLE_DRIVER, ErrorKind::kUnavailable},
        {"vkCreateInstance", VK_ERROR_OUT_OF_HOST_MEMORY, ErrorKind::kUnavailable},
        {"vkEnumeratePhysicalDevices", VK_ERROR_INITIALIZATION_FAILED, ErrorKind::kUnavailable},
    };
    for (const auto& [call, result, kind] : cases) {
        Faults faults{.fail_name = call, .result = result};
        const std::optional<Error> error = session_error(faults);
        ASSERT_TRUE(error.has_value()) << call;
        EXPECT_EQ(error->kind(), kind) << error->what();
    }
}

TEST(FaultInjection, AFenceThatNeverSignalsIsALostDevice) {
    Faults faults{.fail_name = "vkWaitForFences", .result = VK_TIMEOUT};
    const FaultyLoader loader(faults);
    const std::optional<Error> error = error_of(
        [&] { gpu::make_vulkan_backend({}, {.submit_timeout_ms = 3500, .loader = loader.get()}); });
    ASSERT_TRUE(error.has_value());
    EXPECT_EQ(error->kind(), ErrorKind::kDeviceLost);
    EXPECT_TRUE(has(error->what(), "within 3500 ms"));
}

ImageHashes hashes_of(Backend& backend) { return image_hashes(backend, view(32, 32, kRaysShadow)); }

std::size_t hit_count(Backend& backend) {
    Frame frame;
    backend.trace_image(view(32, 32, kRaysAo), frame);
    return static_cast<std::size_t>(
        std::ranges::count_if(frame.hits, [](const Hit& hit) { return hit.prim_id != kNoPrim; }));
}

/// Calls test(device) for devices with and without staging, on which one call fails or, with it,
/// all that come after.
template <class Test>
void on_each_faulty_device(const Test& test) {
    for (const bool force_staging : {false, true}) {
        for (const bool keep_failing : {false, true}) {
            SCOPED_TRACE(testing::Message()
                         << "staging " << force_staging << ", goes on failing " << keep_failing);
            FaultyDevice device({.force_staging = force_staging});
            device.faults.keep_failing = keep_failing;
            test(device);
        }
    }
}

/// Refits and trees are refused, and nothing is hit.
void expect_no_scene(Backend& backend, const TestScene& scene) {
    EXPECT_EQ(hit_count(backend), 0u);
    EXPECT_EQ(kind_of([&] { backend.refit(); }), ErrorKind::kBadArgument);
    EXPECT_EQ(kind_of([&] { backend.refit(RefitExtent::kAll); }), ErrorKind::kBadArgument);
    EXPECT_EQ(kind_of([&] { backend.set_tree(built_tree(scene)); }), ErrorKind::kBadArgument);
    EXPECT_EQ(hit_count(backend), 0u);
}

TEST(FaultInjection, ASceneThatDidNotFitLeavesNoneAndAnotherCanBeSet) {
    const TestScene small = torus(12, 8);
    const TestScene large = torus(24, 16);
    const Bvh bvh = built_tree(small);
    const Bvh large_bvh = built_tree(large);
    on_each_faulty_device([&](FaultyDevice& device) {
        Backend& backend = *device.backend;
        std::optional<MovingScene> moving(std::in_place, backend, small, bvh);
        const ImageHashes expected = hashes_of(backend);
        ASSERT_GT(hit_count(backend), 0u);
        // A refit that is left to the next submission goes with its scene.
        moving->refit(swayed(small, 1));
        const auto set_large = [&] { set_scene(backend, large, large_bvh); };
        const std::size_t failures = fail_in_turn(device.faults, set_large, [&] {
            expect_no_scene(backend, small);
            moving.emplace(backend, small, bvh);
            EXPECT_EQ(hashes_of(backend), expected);
            moving->refit(swayed(small, 1));
        });
        EXPECT_GT(failures, 20u);
        EXPECT_GT(hit_count(backend), 0u);
    });
}

TEST(FaultInjection, AFrameMayFailAtAnyCallAndBeMadeAgain) {
    const TestScene scene = torus(12, 8);
    const std::vector<vec3> moved = swayed(scene, 1);
    for (const bool force_staging : {false, true}) {
        FaultyDevice device({.force_staging = force_staging});
        Backend& backend = *device.backend;
        MovingScene moving(backend, scene, built_tree(scene));
        moving.refit(moved);
        const ImageHashes expected = hashes_of(backend);
        const std::uint64_t tree = tree_hash(backend);
        const auto frame = [&] {
            moving.refit(scene.positions());
            moving.refit(moved);
            hashes_of(backend);
        };
        const std::size_t failures = fail_in_turn(device.faults, frame, [&] {
            // The second refit may not have been called.
            moving.refit(moved);
            EXPECT_EQ(hashes_of(backend), expected);
            EXPECT_EQ(tree_hash(backend), tree);
        });
        EXPECT_GT(failures, 10u);
    }
}

TEST(FaultInjection, ABodyThatCouldNotBeMovedCanBeMovedAgain) {
    const TestScene scene = torus(12, 8);
    std::vector<vec3> rest = scene.world_positions();
    FaultyDevice device({.force_staging = true});
    Backend& backend = *device.backend;
    Pose pose = scene.pose();
    Bvh expected = built_tree(scene);
    const auto move = [&](float s) {
        const Transform transform{{1, -s, 0, 0}, {s, 1, 0, 0}, {0, 0, 1, s}};
        std::vector<vec3> moved;
        for (const vec3& p : rest)
            moved.push_back(scene.space().to_scene(transform_point(transform, p)));
        pose.move_to(moved);
        pose.add_body({0, rest, 1, transform, scene.space()});
        cpu::refit(expected, moved);
        backend.refit();
        EXPECT_EQ(tree_hash(backend), bvh_hash(expected));
    };
    // A new scene on the device has no rest positions, and none may be left in its memory.
    const auto set_again = [&] {
        for (vec3& p : rest) p *= 0.97f;
        backend.set_scene(scene.topology(), pose, expected);
    };
    set_again();
    const auto recover = [&] {
        move(0.5f);
        set_again();
    };
    EXPECT_GT(fail_in_turn(
                  device.faults, [&] { move(0.25f); }, recover),
              5u);
}

TEST(FaultInjection, ATreeOrAnEditThatFailsLeavesTheOldTreeAtTheNewPose) {
    const TestScene scene = torus(12, 8);
    const std::vector<vec3> moved = swayed(scene, 1);
    const Bvh old_tree = loose_tree(scene);
    const Bvh new_tree = build_bvh(scene.topology(), moved);
    ASSERT_NE(old_tree.leaves.size(), new_tree.leaves.size());
    for (const bool edits : {false, true}) {
        const std::vector<vec3>& before = edits ? moved : scene.positions();
        on_each_faulty_device([&](FaultyDevice& device) {
            Backend& backend = *device.backend;
            MovingScene moving(backend, scene, old_tree);
            moving.refit(moved);
            const ImageHashes expected = hashes_of(backend);
            const std::uint64_t refitted = tree_hash(backend);
            moving.refit(scene.positions());
            ASSERT_NE(hashes_of(backend), expected);
            moving.refit(before);
            const auto change = [&] {
                if (!edits) return moving.set_tree(moved, new_tree);
                backend.edit_tree([&](Bvh& bvh) {
                    bvh = new_tree;
                    return true;
                });
            };
            const std::size_t failures = fail_in_turn(device.faults, change, [&] {
                EXPECT_EQ(hashes_of(backend), expected);
                EXPECT_EQ(tree_hash(backend), refitted);
                moving.refit(scene.positions());
                EXPECT_EQ(tree_hash(backend), bvh_hash(old_tree));
                moving.refit(before);
            });
            EXPECT_GT(failures, edits ? 10u : 20u);
            EXPECT_EQ(hashes_of(backend), expected);
            EXPECT_EQ(tree_hash(backend), bvh_hash(new_tree));
        });
    }
}

}  // namespace
}  // namespace mray::test
