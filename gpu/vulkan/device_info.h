// Lists devices, checks whether they are usable, and chooses one.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "gpu/vulkan/instance.h"
#include "gpu/vulkan/vulkan_config.h"

namespace mray::gpu {

/// A device as Vulkan describes it. If it is not usable, only `handle` and `info` are valid.
struct PhysicalDevice {
    VkPhysicalDevice handle = VK_NULL_HANDLE;
    DeviceInfo info;
    VkPhysicalDeviceLimits limits = {};
    VkPhysicalDeviceMemoryProperties memory = {};
    VkDeviceSize max_allocation = 0;
    std::uint32_t queue_family = 0;
    /// 0: no timestamps.
    std::uint32_t timestamp_bits = 0;
    /// Vulkan 1.1 has the rounding modes as an extension.
    bool float_controls_is_extension = false;
};

/// All devices in the loader's order. Throws Error(kUnavailable) if there is none.
std::vector<PhysicalDevice> physical_devices(const Instance& instance);

/// The index of the device that `wanted` names (VulkanConfig::device). Throws Error(kUnavailable),
/// with the list of devices, if there is none, more than one, or if it is not usable.
std::size_t choose_device(std::span<const DeviceInfo> devices, const std::string& wanted);

}  // namespace mray::gpu
