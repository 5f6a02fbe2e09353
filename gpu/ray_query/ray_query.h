// The rays of a Vulkan device's own driver.
#pragma once

#include <memory>

#include "common/driver_rays.h"
#include "gpu/vulkan/vulkan_config.h"

namespace mray::gpu {

/// Throws Error(kUnavailable) as make_vulkan_backend(), and, in one line with the device's name, if
/// the device has less than Vulkan 1.2 or lacks VK_KHR_ray_query or what it needs.
std::unique_ptr<DriverRays> make_ray_query(const VulkanConfig& config = {});

}  // namespace mray::gpu
