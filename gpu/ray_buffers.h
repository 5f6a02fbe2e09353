// Buffers for the rays of one dispatch, which the backends of a device use by turns.
#pragma once

#include <memory>
#include <mutex>
#include <vector>

#include "gpu/limits.h"
#include "gpu/vulkan/buffer.h"
#include "gpu/vulkan/pipeline.h"

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
    Buffer work;
    Buffer states;
    /// The WorkHeader of the last submission, for the host.
    Buffer header;
    /// Copies of results for the host, empty where it sees the device's memory.
    Buffer hits_copy;
    Buffer occlusion_copy;
    Buffer pixels_copy;
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

}  // namespace mray::gpu
