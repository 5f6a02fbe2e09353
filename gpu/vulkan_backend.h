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

/// A device with its pipelines. All of a process's backends on a physical device share it, but
/// those with validation or with a host's device.
struct SharedDevice;

/// Throws Error(kUnavailable) as list_devices(), and for: no such device, an ambiguous name, a
/// device that lacks a feature, a validation layer that is not installed, a host's device that its
/// instance does not list, or a queue family without compute. Threads may call it at the same time.
std::shared_ptr<SharedDevice> open_device(const VulkanConfig& config);
/// Whether work on the device failed for good; open_device() then makes another.
bool is_lost(const SharedDevice& device);

/// A submission that takes longer than the time limit counts as a lost device. Throws
/// Error(kDeviceLost) if the device does not answer, Error(kLimit) without memory.
std::unique_ptr<Backend> make_vulkan_backend(std::shared_ptr<SharedDevice> device,
                                             std::uint64_t time_limit_ms = 60'000);
/// Opens the device, too.
std::unique_ptr<Backend> make_vulkan_backend(const VulkanConfig& config = {});

}  // namespace mray::gpu
