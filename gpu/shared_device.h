// The devices of a process: one instance of Vulkan, and one device for each physical one, for all
// backends.
#pragma once

#include <memory>

#include "gpu/ray_buffers.h"
#include "gpu/vulkan/device.h"
#include "gpu/vulkan/pipeline.h"
#include "gpu/vulkan_backend.h"

namespace mray::gpu {

/// A device, and what is made of it once for all of its backends.
struct SharedDevice {
    SharedDevice(std::shared_ptr<Instance> instance, PhysicalDevice physical, bool force_staging)
        : device(std::move(instance), std::move(physical), force_staging) {}

    Device device;
    Pipelines pipelines;
    RayBufferPool ray_buffers;
};

}  // namespace mray::gpu
