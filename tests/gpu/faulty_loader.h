// A Vulkan loader whose calls fail on demand, and whose devices report other properties.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>

#include "gpu/vulkan/vulkan_api.h"

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
    std::string fail_name;
    VkResult result = VK_ERROR_OUT_OF_DEVICE_MEMORY;

    std::function<void(VkPhysicalDeviceProperties&)> edit_properties;
    std::function<void(VkPhysicalDeviceFloatControlsProperties&)> edit_float_controls;
    std::function<void(VkQueueFamilyProperties&)> edit_queue_family;
    bool hide_devices = false;
    /// Changes the words of kernels.
    std::function<void(std::span<std::uint32_t>)> edit_kernel;

    /// Out: the number of calls, and the name of the one that failed.
    std::size_t call_count = 0;
    std::string failed_name;
};

/// Applies `faults` to calls during its lifetime. There can be one at a time.
class FaultyLoader {
public:
    explicit FaultyLoader(Faults& faults);
    ~FaultyLoader();
    FaultyLoader(const FaultyLoader&) = delete;
    FaultyLoader& operator=(const FaultyLoader&) = delete;

    PFN_vkGetInstanceProcAddr get() const;
};

}  // namespace mray::test
