// A Vulkan loader whose calls fail on demand, and whose devices report other properties.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/errors.h"
#include "gpu/shared_device.h"

namespace mray::test {

/// The faults of a loader. Calls that return a VkResult are counted from 0: all of them, or those
/// that `counts` accepts.
struct Faults {
    static constexpr std::size_t kNever = ~std::size_t{0};

    std::size_t fail_at = kNever;
    /// Whether the calls after that one fail, too.
    bool keep_failing = false;
    std::function<bool(std::string_view)> counts = [](std::string_view) { return true; };
    /// Fails every call of this name instead, if set.
    std::string fail_name = {};
    VkResult result = VK_ERROR_OUT_OF_DEVICE_MEMORY;

    std::function<void(VkPhysicalDeviceProperties&)> edit_properties = {};
    std::function<void(VkPhysicalDeviceFloatControlsProperties&)> edit_float_controls = {};
    std::function<void(VkQueueFamilyProperties&)> edit_queue_family = {};
    bool hide_devices = false;
    /// Changes the words of kernels.
    std::function<void(std::vector<std::uint32_t>&)> edit_kernel = {};

    /// Out: the number of calls, and the name of the one that failed.
    std::size_t call_count = 0;
    std::string failed_name = {};
};

/// The limits that every device of Vulkan has at least, as far as the backend reads them.
inline void set_least_limits(VkPhysicalDeviceProperties& properties) {
    VkPhysicalDeviceLimits& limits = properties.limits;
    limits.maxTexelBufferElements = 1u << 16;
    limits.maxStorageBufferRange = 1u << 27;
    limits.maxPushConstantsSize = 128;
    limits.maxPerStageDescriptorStorageBuffers = 4;
    limits.maxDescriptorSetStorageBuffers = 24;
    limits.maxComputeWorkGroupCount[0] = 65535;
    limits.maxComputeWorkGroupInvocations = 128;
    limits.maxComputeWorkGroupSize[0] = 128;
}

/// Applies `faults` to calls during its lifetime. There can be one at a time.
class FaultyLoader {
public:
    explicit FaultyLoader(Faults& faults);
    ~FaultyLoader();
    FaultyLoader(const FaultyLoader&) = delete;
    FaultyLoader& operator=(const FaultyLoader&) = delete;

    PFN_vkGetInstanceProcAddr get() const;
};

/// A backend whose Vulkan calls fail on demand.
struct FaultyDevice {
    explicit FaultyDevice(gpu::Tuning tuning = {}) {
        tuning.loader = loader.get();
        backend = gpu::make_vulkan_backend({}, tuning);
    }

    Faults faults;
    FaultyLoader loader{faults};
    std::unique_ptr<Backend> backend;
};

/// Lets the first call of an action fail, then the second, and so on until the action ends without
/// a failure. After each failure calls recover(), which sees no faults. Returns the number of
/// failures; the test fails if an action hides one.
template <class Action, class Recover>
std::size_t fail_in_turn(Faults& faults, const Action& action, const Recover& recover) {
    constexpr std::size_t kTooMany = 1000;
    for (std::size_t k = 0; k < kTooMany; ++k) {
        SCOPED_TRACE(k);
        faults.failed_name.clear();
        faults.fail_at = faults.call_count + k;
        bool has_thrown = false;
        try {
            action();
        } catch (const Error&) {
            has_thrown = true;
        }
        faults.fail_at = Faults::kNever;
        EXPECT_EQ(has_thrown, !faults.failed_name.empty()) << faults.failed_name;
        if (!has_thrown) return k;
        recover();
    }
    ADD_FAILURE() << "the action has more than " << kTooMany << " calls";
    return kTooMany;
}

}  // namespace mray::test
