// The backend with settings for tests.
#pragma once

#include "gpu/tuning.h"
#include "gpu/vulkan_backend.h"

namespace morphray::gpu {

/// As make_vulkan_backend(config), which uses the default tuning.
std::unique_ptr<Backend> make_vulkan_backend(const VulkanConfig& config, const Tuning& tuning);
std::vector<DeviceInfo> list_devices(PFN_vkGetInstanceProcAddr loader);

}  // namespace morphray::gpu
