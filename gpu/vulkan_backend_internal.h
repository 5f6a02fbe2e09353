// The backend with settings for tests.
#pragma once

#include "gpu/vulkan/tuning.h"
#include "gpu/vulkan_backend.h"

namespace mray::gpu {

/// make_vulkan_backend(config) with this tuning instead of the default one.
std::unique_ptr<Backend> make_vulkan_backend(const VulkanConfig& config, const Tuning& tuning);
std::unique_ptr<Backend> make_tuned_backend(std::shared_ptr<SharedDevice> device,
                                            const Tuning& tuning);
std::vector<DeviceInfo> list_devices(PFN_vkGetInstanceProcAddr loader);

}  // namespace mray::gpu
