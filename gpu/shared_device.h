// The devices of a process: one instance, and one device for each physical one, for all backends.
#pragma once

#include <memory>
#include <mutex>
#include <vector>

#include "gpu/limits.h"
#include "gpu/vulkan/pipeline.h"
#include "gpu/vulkan_backend.h"

namespace mray::gpu {

struct RayBuffers {
    RayBuffers(Device& device, const PassSize& size, BufferKind kind);

    void add_to(Bindings& bindings) const;

    PassSize size;
    BufferKind kind;
    ReadBuffer rays;
    ReadBuffer hits;
    ReadBuffer visible_pixels;
    ReadBuffer occlusion;
    Buffer pixels;
    /// Three floats a pixel.
    Buffer linear;
    Buffer work;
    Buffer states;
    /// The WorkHeader of the last submission, for the host.
    Buffer header;
    /// Copies of results for the host, empty where it sees the device's memory. A kernel writes to
    /// that of hits.
    Buffer hits_copy;
    Buffer occlusion_copy;
    Buffer pixels_copy;
    Buffer linear_copy;
};

/// Keeps buffers that no backend uses. Threads may share it.
class RayBufferPool {
public:
    /// Takes buffers of this size, or makes them. Throws Error(kLimit) if memory runs out.
    std::unique_ptr<RayBuffers> take(Device& device, const PassSize& size, BufferKind kind);
    void give_back(std::unique_ptr<RayBuffers> buffers) noexcept;

private:
    std::mutex mutex_;
    std::vector<std::unique_ptr<RayBuffers>> idle_;
};

/// A device, and what is made of it once for all of its backends.
struct SharedDevice {
    SharedDevice(std::shared_ptr<Instance> instance, PhysicalDevice physical, bool force_staging)
        : device(std::move(instance), std::move(physical), force_staging) {}

    Device device;
    Pipelines pipelines;
    RayBufferPool ray_buffers;
};

}  // namespace mray::gpu
