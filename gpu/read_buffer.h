// A buffer that kernels read: as texels or as it is, whichever is faster on the device.
#pragma once

#include "gpu/vulkan/buffer.h"
#include "gpu/vulkan/pipeline.h"

namespace mray::gpu {

struct ReadBuffer {
    ReadBuffer() = default;
    /// `usage` is what else it is used for; `texels` whether uniform or storage texels are read.
    ReadBuffer(Device& device, BufferKind kind, const char* name, VkDeviceSize size,
               VkFormat format, VkBufferUsageFlags usage = 0,
               VkBufferUsageFlags texels = VK_BUFFER_USAGE_UNIFORM_TEXEL_BUFFER_BIT)
        : buffer(device, name, size, usage | (kind == BufferKind::kTexels ? texels : kInStorage),
                 Memory::kDevice) {
        if (kind == BufferKind::kTexels) view = texel_view(device, name, buffer, format);
    }

    void bind(Bindings& bindings, std::uint32_t number) const {
        bindings.views[number] = view.get();
        bindings.buffers[number] = buffer.get();
    }

    static constexpr VkBufferUsageFlags kInStorage = VK_BUFFER_USAGE_STORAGE_BUFFER_BIT;

    Buffer buffer;
    /// Null for a storage buffer.
    UniqueBufferView view;
};

}  // namespace mray::gpu
