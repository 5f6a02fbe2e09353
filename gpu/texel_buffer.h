// A buffer that kernels read as texels.
#pragma once

#include "gpu/vulkan/buffer.h"

namespace mray::gpu {

struct TexelBuffer {
    TexelBuffer() = default;
    TexelBuffer(Context& context, const char* name, VkDeviceSize size, VkFormat format,
                VkBufferUsageFlags usage = VK_BUFFER_USAGE_UNIFORM_TEXEL_BUFFER_BIT)
        : buffer(context, name, size, usage, Memory::kDevice),
          view(texel_view(context, name, buffer, format)) {}

    Buffer buffer;
    UniqueBufferView view;
};

}  // namespace mray::gpu
