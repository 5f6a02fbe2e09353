// Every Vulkan call that fails gives an Error of the right kind, and nothing leaks (which the
// address sanitizer checks).
#include <gtest/gtest.h>

#include <optional>

#include "common/base/errors.h"
#include "gpu/vulkan/result.h"
#include "gpu/vulkan_backend_internal.h"
#include "tests/gpu/faulty_loader.h"
#include "tests/gpu/test_scenes.h"

namespace mray::test {
namespace {

/// A session that uses everything but packets once, in dispatches of one tile. (Some drivers
/// compile packets for a third of a second each time; another test has packets.)
void run_session(const FaultyLoader& loader, bool force_staging) {
    gpu::Tuning tuning;
    tuning.loader = loader.get();
    tuning.force_staging = force_staging;
    tuning.use_packets = false;
    tuning.step_budget = 20;
    tuning.tiles_per_dispatch = 16;
    const std::unique_ptr<Backend> backend = gpu::make_vulkan_backend({}, tuning);
    const DeviceScene scene = torus(12, 8);
    Bvh bvh = plain_tree(scene);
    backend->set_scene(scene.topology, scene.positions, bvh);
    backend->refit(swayed(scene, 1));
    Frame frame;
    backend->trace_image(view(16, 16, kRaysShadow), frame);
    std::vector<Hit> hits(64);
    backend->trace_rays(scattered_rays(64, 1), hits);
    backend->read_tree(bvh);
}

/// The error at the end of a session with these faults.
std::optional<Error> session_error(Faults& faults, bool force_staging = false) {
    const FaultyLoader loader(faults);
    try {
        run_session(loader, force_staging);
    } catch (const Error& error) {
        return error;
    }
    return std::nullopt;
}

/// Fails the calls of a session that count one by one, until there are no more.
void fail_each_call(VkResult result, bool force_staging, bool (*counts)(std::string_view)) {
    std::size_t failures = 0;
    for (;; ++failures) {
        Faults faults;
        faults.counts = counts;
        faults.fail_at = failures;
        faults.result = result;
        const std::optional<Error> error = session_error(faults, force_staging);
        ASSERT_EQ(error.has_value(), !faults.failed_name.empty()) << faults.failed_name;
        if (!error) break;
        EXPECT_EQ(error->kind(), gpu::error_kind_of(result))
            << faults.failed_name << ": " << error->what();
    }
    EXPECT_GT(failures, 20u);
}

// Names for debuggers are a third of all calls; another test lets one of them fail.
TEST(FaultInjection, EveryCallThatRunsOutOfDeviceMemoryGivesALimitError) {
    fail_each_call(VK_ERROR_OUT_OF_DEVICE_MEMORY, false,
                   [](std::string_view name) { return name != "vkSetDebugUtilsObjectNameEXT"; });
}

TEST(FaultInjection, EverySubmissionThatLosesTheDeviceGivesADeviceLostError) {
    fail_each_call(VK_ERROR_DEVICE_LOST, true,
                   [](std::string_view name) { return name == "vkQueueSubmit"; });
}

struct Case {
    const char* call;
    VkResult result;
    ErrorKind kind;
};

TEST(FaultInjection, EachKindOfFailureHasItsErrorKind) {
    const Case cases[] = {
        {"vkAllocateMemory", VK_ERROR_OUT_OF_DEVICE_MEMORY, ErrorKind::kLimit},
        {"vkAllocateMemory", VK_ERROR_OUT_OF_HOST_MEMORY, ErrorKind::kLimit},
        {"vkSetDebugUtilsObjectNameEXT", VK_ERROR_OUT_OF_HOST_MEMORY, ErrorKind::kLimit},
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
    for (const Case& c : cases) {
        Faults faults;
        faults.fail_name = c.call;
        faults.result = c.result;
        const std::optional<Error> error = session_error(faults);
        ASSERT_TRUE(error.has_value()) << c.call;
        EXPECT_EQ(error->kind(), c.kind) << error->what();
    }
}

TEST(FaultInjection, AFenceThatNeverSignalsIsALostDevice) {
    Faults faults;
    faults.fail_name = "vkWaitForFences";
    faults.result = VK_TIMEOUT;
    const FaultyLoader loader(faults);
    gpu::Tuning tuning;
    tuning.loader = loader.get();
    tuning.submit_timeout_ms = 3500;
    try {
        gpu::make_vulkan_backend({}, tuning);
        FAIL();
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kDeviceLost);
        EXPECT_NE(std::string(error.what()).find("within 3500 ms"), std::string::npos);
    }
}

TEST(FaultInjection, ABackendWhoseSceneDidNotFitCanTakeAnother) {
    Faults faults;
    const FaultyLoader loader(faults);
    gpu::Tuning tuning;
    tuning.loader = loader.get();
    const std::unique_ptr<Backend> backend = gpu::make_vulkan_backend({}, tuning);
    const DeviceScene scene = torus(12, 8);
    const Bvh bvh = plain_tree(scene);
    for (std::size_t k = 0; k < 40; ++k) {
        faults.fail_at = faults.call_count + k;
        EXPECT_THROW(backend->set_scene(scene.topology, scene.positions, bvh), Error);
        faults.fail_at = Faults::kNever;
        Frame frame;
        backend->trace_image(view(8, 8, kRaysAo), frame);  // of nothing
        EXPECT_EQ(frame.hits.front().prim_id, kNoPrim);
    }
    backend->set_scene(scene.topology, scene.positions, bvh);
    Frame frame;
    backend->trace_image(view(32, 32, kRaysPrimary), frame);
    EXPECT_TRUE(std::any_of(frame.hits.begin(), frame.hits.end(),
                            [](const Hit& hit) { return hit.prim_id != kNoPrim; }));
}

/// Fails each call of an update and an image by packets in turn. The next image must be right.
void fail_each_call_of_a_frame(bool force_staging) {
    Faults faults;
    const FaultyLoader loader(faults);
    gpu::Tuning tuning;
    tuning.loader = loader.get();
    tuning.force_staging = force_staging;
    const std::unique_ptr<Backend> backend = gpu::make_vulkan_backend({}, tuning);
    const DeviceScene scene = torus(12, 8);
    backend->set_scene(scene.topology, scene.positions, plain_tree(scene));
    const std::vector<vec3> moved = swayed(scene, 1);
    Frame expected;
    backend->refit(moved);
    backend->trace_image(view(32, 32, kRaysShadow), expected);
    bool has_failed = true;
    std::size_t k = 0;
    for (; has_failed; ++k) {
        ASSERT_LT(k, 1000u);
        faults.fail_at = faults.call_count + k;
        has_failed = false;
        Frame frame;
        try {
            backend->refit(scene.positions);
            backend->refit(moved);
            backend->trace_image(view(32, 32, kRaysShadow), frame);
        } catch (const Error&) {
            has_failed = true;
        }
        faults.fail_at = Faults::kNever;
        // The second refit may not have been called.
        backend->refit(moved);
        Frame again;
        backend->trace_image(view(32, 32, kRaysShadow), again);
        ASSERT_EQ(hits_hash(again), hits_hash(expected)) << k;
        ASSERT_EQ(image_hash(again), image_hash(expected)) << k;
    }
    EXPECT_GT(k, 10u);
}

TEST(FaultInjection, AFrameOfPacketsMayFailAtAnyCallAndBeMadeAgain) {
    fail_each_call_of_a_frame(false);
}

TEST(FaultInjection, AFrameOfPacketsThroughStagingMayFailAtAnyCallAndBeMadeAgain) {
    fail_each_call_of_a_frame(true);
}

TEST(FaultInjection, AFrameWhoseTreeDidNotFitLeavesTheOldTree) {
    Faults faults;
    const FaultyLoader loader(faults);
    gpu::Tuning tuning;
    tuning.loader = loader.get();
    const std::unique_ptr<Backend> backend = gpu::make_vulkan_backend({}, tuning);
    const DeviceScene scene = torus(12, 8);
    const Bvh bvh = plain_tree(scene);
    backend->set_scene(scene.topology, scene.positions, bvh);
    Frame before;
    backend->trace_image(view(32, 32, kRaysShadow), before);
    for (std::size_t k = 0; k < 20; ++k) {
        faults.fail_at = faults.call_count + k;
        EXPECT_THROW(backend->set_frame(scene.positions, bvh), Error);
        faults.fail_at = Faults::kNever;
        Frame after;
        backend->trace_image(view(32, 32, kRaysShadow), after);
        EXPECT_EQ(hits_hash(before), hits_hash(after));
    }
}

}  // namespace
}  // namespace mray::test
