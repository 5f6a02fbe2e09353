// Which devices there are, whether they will do, and which one the user means.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "gpu/vulkan/instance.h"
#include "gpu/vulkan_backend.h"

namespace morphray::gpu {

/// A device as Vulkan describes it. Meaningful beyond `handle` and `info` only if usable.
struct PhysicalDevice {
    VkPhysicalDevice handle = VK_NULL_HANDLE;
    DeviceInfo info;
    VkPhysicalDeviceLimits limits = {};
    VkPhysicalDeviceMemoryProperties memory = {};
    VkDeviceSize max_allocation = 0;
    std::uint32_t queue_family = 0;
    /// Whether compute kernels may read each other's registers within a subgroup.
    bool has_shuffle = false;
    /// 0: no timestamps.
    std::uint32_t timestamp_bits = 0;
    /// Vulkan 1.1 has the rounding modes as an extension.
    bool float_controls_is_extension = false;
};

/// In the loader's order; at least one. Throws Error(kUnavailable) if there is none.
std::vector<PhysicalDevice> physical_devices(const Instance& instance);

/// The index of the device that `wanted` names (see VulkanConfig::device). Throws
/// Error(kUnavailable), with the list of devices in the text, when there is no such device, more
/// than one, or it cannot be used.
std::size_t choose_device(std::span<const DeviceInfo> devices, const std::string& wanted);

}  // namespace morphray::gpu
