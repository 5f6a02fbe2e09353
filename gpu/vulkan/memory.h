// Buffers, their memory, and how kernels see them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "gpu/vulkan/vulkan_api.h"
#include "gpu/vulkan/vulkan_config.h"
#include "shaders/kernel_interface.h"

namespace mray::gpu {

class Device;

/// An allocation, mapped for as long as it lives if the host sees it. Threads may share it.
class MemoryBlock {
public:
    MemoryBlock(VkDevice device, const std::string& name, VkDeviceSize size, std::uint32_t type,
                bool is_mapped);

    VkDeviceMemory get() const { return memory_.get(); }
    std::uint32_t type() const { return type_; }
    /// Empty if it is not mapped.
    std::span<std::byte> mapped() const { return mapped_; }

    /// Allocates bytes at a multiple of `alignment`; returns their offset, or kNoSpace.
    VkDeviceSize take(VkDeviceSize size, VkDeviceSize alignment);
    void give_back(VkDeviceSize offset, VkDeviceSize size);
    static constexpr VkDeviceSize kNoSpace = ~VkDeviceSize{0};

private:
    struct Range {
        VkDeviceSize begin, end;
    };

    UniqueMemory memory_;
    std::uint32_t type_;
    std::span<std::byte> mapped_;
    std::mutex mutex_;
    /// Free ranges in ascending order; no two touch.
    std::vector<Range> free_;
    std::size_t range_count_ = 0;
};

/// Bytes of a block, which it gives back at its end.
struct MemoryRange {
    explicit MemoryRange(VkDeviceSize bytes) : size(bytes) {}
    ~MemoryRange() {
        if (block != nullptr) block->give_back(offset, size);
    }
    MemoryRange(const MemoryRange&) = delete;

    std::shared_ptr<MemoryBlock> block;
    VkDeviceSize offset = 0;
    VkDeviceSize size;
};

/// Small buffers share a block, since some devices allow 4,096 allocations. Threads may share it.
class MemoryBlocks {
public:
    /// Allocates memory for a buffer `name`. Throws Error(kLimit) if there is not enough.
    std::unique_ptr<const MemoryRange> take(VkDevice device, const std::string& name,
                                            const VkMemoryRequirements& needs, std::uint32_t type,
                                            bool is_mapped);

private:
    std::mutex mutex_;
    std::vector<std::weak_ptr<MemoryBlock>> blocks_;
};

enum class Memory {
    kDevice,  // fastest for the device; mapped if the host sees it through its cache
    kHost,    // mapped, for copies
};

struct MemoryChoice {
    std::uint32_t type;
    /// Whether the host maps it: device memory only if cached, since uncached reads are slow.
    bool is_mapped;
};
/// Chooses among the memory types of a device whose bits a buffer allows. Throws
/// Error(kUnavailable) if none is suitable, which Vulkan rules out.
MemoryChoice choose_memory(const VkPhysicalDeviceMemoryProperties& properties,
                           std::uint32_t allowed_bits, Memory memory);

class Buffer {
public:
    Buffer() = default;
    /// May be some bytes larger than `size`. Throws Error(kLimit) without memory for it.
    Buffer(Device& device, const std::string& name, VkDeviceSize size, VkBufferUsageFlags usage,
           Memory memory);

    VkBuffer get() const { return buffer_.get(); }
    VkDeviceSize size() const { return size_; }
    /// The memory as the host sees it, coherently; empty if the host does not see it.
    std::span<std::byte> mapped() const { return mapped_; }

private:
    /// An assignment may free it before the buffer, which is then only destroyed, as Vulkan allows.
    std::unique_ptr<const MemoryRange> memory_;
    UniqueBuffer buffer_;
    VkDeviceSize size_ = 0;
    std::span<std::byte> mapped_;
};

/// The resource of each binding number, a view or a buffer; null if there is none.
struct Bindings {
    std::array<VkBufferView, kBindingCount> views = {};
    std::array<VkBuffer, kBindingCount> buffers = {};
};

/// A buffer that kernels read as texels or as storage, whichever is faster on the device.
struct ReadBuffer {
    ReadBuffer() = default;
    /// Texels are uniform ones, or storage texels if the buffer `is_written` by words too.
    ReadBuffer(Device& device, BufferKind kind, const char* name, VkDeviceSize size,
               VkFormat format, VkBufferUsageFlags usage = 0, bool is_written = false);

    void bind(Bindings& bindings, std::uint32_t number, bool by_words = false) const;

    Buffer buffer;
    UniqueBufferView view;   // null for a storage buffer
    UniqueBufferView words;  // null unless written by words
};

}  // namespace mray::gpu
