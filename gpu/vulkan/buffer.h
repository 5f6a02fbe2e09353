// Buffers with their memory, and how kernels see them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "gpu/vulkan/device.h"
#include "shaders/kernel_interface.h"

namespace mray::gpu {

enum class Memory {
    kDevice,  // fastest for the device; mapped if the host sees it through its cache
    kHost,    // mapped, for copies
};

struct MemoryChoice {
    std::uint32_t type;
    /// Whether the host maps it: device memory only if cached, since uncached reads are slow.
    bool is_mapped;
};
/// Chooses among the memory types of a device that a buffer allows (as bits, VkMemoryRequirements).
/// Throws Error(kUnavailable) if none will do, which Vulkan rules out.
MemoryChoice choose_memory(const VkPhysicalDeviceMemoryProperties& properties,
                           std::uint32_t allowed_bits, Memory memory);

class Buffer {
public:
    Buffer() = default;
    /// Makes a buffer that may be some bytes larger than `size` and is never empty. Throws
    /// Error(kLimit), which names it, if there is not enough memory.
    Buffer(Device& device, const std::string& name, VkDeviceSize size, VkBufferUsageFlags usage,
           Memory memory);

    VkBuffer get() const { return buffer_.get(); }
    VkDeviceSize size() const { return size_; }
    /// The memory as the host sees it, coherently; empty if the host does not see it.
    std::span<std::byte> mapped() const { return mapped_; }

private:
    MemoryPart memory_;
    UniqueBuffer buffer_;
    VkDeviceSize size_ = 0;
    std::span<std::byte> mapped_;
};

UniqueBufferView texel_view(Device& device, const Buffer& buffer, VkFormat format);

/// The resource of each binding number, a view or a buffer; null if there is none.
struct Bindings {
    std::array<VkBufferView, kBindingCount> views = {};
    std::array<VkBuffer, kBindingCount> buffers = {};
};

/// A buffer that kernels read: as texels or as it is, whichever is faster on the device.
struct ReadBuffer {
    ReadBuffer() = default;
    /// `usage` is what else it is used for; `texels` whether uniform or storage texels are read.
    ReadBuffer(Device& device, BufferKind kind, const char* name, VkDeviceSize size,
               VkFormat format, VkBufferUsageFlags usage = 0,
               VkBufferUsageFlags texels = VK_BUFFER_USAGE_UNIFORM_TEXEL_BUFFER_BIT)
        : buffer(device, name, size, usage | (kind == BufferKind::kTexels ? texels : kInStorage),
                 Memory::kDevice) {
        if (kind == BufferKind::kTexels) view = texel_view(device, buffer, format);
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
