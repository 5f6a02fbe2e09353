// Memory of buffers: small ones share a block, since some devices allow 4,096 allocations.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "gpu/vulkan/unique_handle.h"

namespace mray::gpu {

/// An allocation, mapped for as long as it lives if the host sees it. Threads may share it.
class MemoryBlock {
public:
    MemoryBlock(VkDevice device, const std::string& name, VkDeviceSize size, std::uint32_t type,
                bool is_mapped);

    VkDeviceMemory get() const { return memory_.get(); }
    std::uint32_t type() const { return type_; }
    /// Empty if it is not mapped.
    std::span<std::byte> mapped() const { return mapped_; }

    /// Takes bytes at a multiple of `alignment`; returns their offset, or kNoRoom.
    VkDeviceSize take(VkDeviceSize size, VkDeviceSize alignment);
    void give_back(VkDeviceSize offset, VkDeviceSize size);
    static constexpr VkDeviceSize kNoRoom = ~VkDeviceSize{0};

private:
    struct Range {
        VkDeviceSize begin, end;
    };

    UniqueMemory memory_;
    std::uint32_t type_;
    std::span<std::byte> mapped_;
    std::mutex mutex_;
    /// What is free, in ascending order; no two ranges touch.
    std::vector<Range> free_;
    std::size_t part_count_ = 0;
};

/// A part of a block, which goes back to it at its end.
class MemoryPart {
public:
    MemoryPart() = default;
    MemoryPart(std::shared_ptr<MemoryBlock> block, VkDeviceSize offset, VkDeviceSize size)
        : block_(std::move(block)), offset_(offset), size_(size) {}
    MemoryPart(MemoryPart&& other) noexcept { swap(other); }
    MemoryPart& operator=(MemoryPart&& other) noexcept {
        swap(other);
        return *this;
    }
    ~MemoryPart() {
        if (block_ != nullptr) block_->give_back(offset_, size_);
    }

    const MemoryBlock& block() const { return *block_; }
    VkDeviceSize offset() const { return offset_; }

private:
    void swap(MemoryPart& other) {
        std::swap(block_, other.block_);
        std::swap(offset_, other.offset_);
        std::swap(size_, other.size_);
    }

    std::shared_ptr<MemoryBlock> block_;
    VkDeviceSize offset_ = 0;
    VkDeviceSize size_ = 0;
};

/// Threads may share it.
class MemoryBlocks {
public:
    /// Takes memory for a buffer `name`. Throws Error(kLimit) if there is not enough.
    MemoryPart take(VkDevice device, const std::string& name, const VkMemoryRequirements& needs,
                    std::uint32_t type, bool is_mapped);

private:
    std::mutex mutex_;
    std::vector<std::weak_ptr<MemoryBlock>> blocks_;
};

}  // namespace mray::gpu
