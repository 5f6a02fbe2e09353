// The backend of a Vulkan device.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "common/backend.h"
#include "gpu/vulkan/vulkan_config.h"

namespace mray::gpu {

/// Throws Error(kUnavailable), with a text for each cause: no Vulkan loader, no driver, a broken
/// driver.
std::vector<DeviceInfo> list_devices();

/// The device that VulkanConfig::device names. Throws Error(kUnavailable) as make_vulkan_backend().
DeviceInfo find_device(const std::string& device);

/// Throws Error(kUnavailable) as list_devices(), and for: no such device, an ambiguous name, a
/// device that lacks a feature, a validation layer that is not installed, a host's device that its
/// instance does not list, or a queue family without compute.
std::unique_ptr<Backend> make_vulkan_backend(const VulkanConfig& config = {});

}  // namespace mray::gpu
