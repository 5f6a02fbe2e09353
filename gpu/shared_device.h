// The devices of a process: one instance of Vulkan, and one device for each physical one, for all
// backends.
#pragma once

#include <memory>
#include <vector>

#include "gpu/ray_buffers.h"
#include "gpu/vulkan/device.h"
#include "gpu/vulkan/pipeline.h"
#include "gpu/vulkan/tuning.h"
#include "gpu/vulkan_backend.h"

namespace mray::gpu {

/// A device, and what is made of it once for all of its backends.
struct SharedDevice {
    SharedDevice(std::shared_ptr<Instance> instance, PhysicalDevice physical,
                 std::shared_ptr<const HostDevice> host, bool force_staging)
        : device(std::move(instance), std::move(physical), std::move(host), force_staging) {}

    Device device;
    Pipelines pipelines;
    RayBufferPool ray_buffers;
};

/// The device that `config` names: made when it is first opened and, after it was lost, when it is
/// next opened, and kept until the process ends. A device that is validated, adopted, or tuned in
/// its loader, log or staging is made for the caller alone, and ends with its last user. Throws
/// Error as make_vulkan_backend(). Threads may call it at the same time.
std::shared_ptr<SharedDevice> open_device(const VulkanConfig& config, const Tuning& tuning);

/// The devices that the process's instance sees, or one of `loader` if that is not null.
std::vector<PhysicalDevice> physical_devices(PFN_vkGetInstanceProcAddr loader);

// ---- The backend with settings for tests

/// make_vulkan_backend(config) with this tuning instead of the default one.
std::unique_ptr<Backend> make_vulkan_backend(const VulkanConfig& config, const Tuning& tuning);
std::unique_ptr<Backend> make_tuned_backend(std::shared_ptr<SharedDevice> device,
                                            const Tuning& tuning);
std::vector<DeviceInfo> list_devices(PFN_vkGetInstanceProcAddr loader);

}  // namespace mray::gpu
