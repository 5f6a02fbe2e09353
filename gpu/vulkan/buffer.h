// Memory of the device.
#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "gpu/vulkan/context.h"

namespace morphray::gpu {

enum class Memory {
    kDevice,  // fastest for the device; mapped if the host can see it and reads it from its cache
    kHost,    // mapped, for copies
};

/// One buffer with memory of its own: there are fewer than 30 of them.
class Buffer {
public:
    Buffer() = default;
    /// The buffer may be some bytes larger than `size`, and is never empty. Throws
    /// Error(kLimit) when there is not enough memory.
    Buffer(Context& context, const std::string& name, VkDeviceSize size, VkBufferUsageFlags usage,
           Memory memory);

    VkBuffer get() const { return buffer_.get(); }
    VkDeviceSize size() const { return size_; }
    /// All of it as the host sees it, coherently; empty if it does not.
    std::span<std::byte> mapped() const { return mapped_; }

private:
    UniqueMemory memory_;
    UniqueBuffer buffer_;
    VkDeviceSize size_ = 0;
    std::span<std::byte> mapped_;
};

/// All of a buffer as a texel buffer.
UniqueBufferView texel_view(Context& context, const std::string& name, const Buffer& buffer,
                            VkFormat format);

}  // namespace morphray::gpu
