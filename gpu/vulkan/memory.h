// Memory of buffers: small ones share a block, since a device allows few allocations (4,096 on
// some).
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

/// An allocation, mapped for as long as it lives if the host sees it.
struct MemoryBlock {
    UniqueMemory memory;
    std::uint32_t type = 0;
    VkDeviceSize size = 0;
    /// Bytes that have been given out.
    VkDeviceSize used = 0;
    /// Empty if it is not mapped.
    std::span<std::byte> mapped;
};

/// A part of a block, which lives as long as one of its parts.
struct MemoryPart {
    std::shared_ptr<const MemoryBlock> block;
    VkDeviceSize offset = 0;
};

/// Threads may share it.
class MemoryBlocks {
public:
    /// Takes memory for a buffer `name`. Throws Error(kLimit) if there is not enough.
    MemoryPart take(VkDevice device, const std::string& name, const VkMemoryRequirements& needs,
                    std::uint32_t type, bool is_mapped);

private:
    std::mutex mutex_;
    /// The block of each type of memory, mapped or not, that still has room.
    std::vector<std::weak_ptr<MemoryBlock>> open_;
};

}  // namespace mray::gpu
