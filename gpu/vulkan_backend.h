#pragma once

#include <memory>
#include <string>
#include <vector>

#include "common/backend.h"
#include "gpu/vulkan/vulkan_config.h"

namespace mray::gpu {

/// The devices that the process's instance sees, or one of `loader` if that is not null. Throws
/// Error(kUnavailable), with a text for each cause: no Vulkan loader, no driver that starts.
std::vector<DeviceInfo> list_devices(LoaderFunction loader = nullptr);

/// The device that VulkanConfig::device names. Throws Error(kUnavailable) as make_vulkan_backend().
DeviceInfo find_device(const std::string& device);

/// A device with its pipelines, which backends share.
struct SharedDevice;

/// The device that `config` names, kept until the process ends, and made anew after it was lost. A
/// device that is validated, or tuned in its loader, log or staging, is made for the caller alone.
/// Throws Error(kUnavailable) as list_devices(), and for: no such device, an ambiguous name, a
/// device that lacks a feature, no validation layer. Threads may call it at the same time.
std::shared_ptr<SharedDevice> open_device(const VulkanConfig& config, const Tuning& tuning = {});
/// Whether work on the device failed for good; open_device() then makes another.
bool is_lost(const SharedDevice& device);

/// A backend that takes one call at a time, and only queries as in gpu/queries.h;
/// cpu/cpu_backend.h adds the rest. Its finish() has the times of trace(), too. Throws
/// Error(kDeviceLost) if the device does not answer, Error(kLimit) without memory.
std::unique_ptr<Backend> make_backend_on(std::shared_ptr<SharedDevice> device,
                                         const Tuning& tuning = {});
std::unique_ptr<Backend> make_vulkan_backend(const VulkanConfig& config = {},
                                             const Tuning& tuning = {});

}  // namespace mray::gpu
