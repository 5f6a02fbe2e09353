#include "gpu/vulkan/memory.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>

#include "gpu/vulkan/result.h"

namespace mray::gpu {
namespace {

constexpr VkDeviceSize kBlockBytes = VkDeviceSize{8} << 20;
/// Buffers above it have blocks of their own.
constexpr VkDeviceSize kSmallBytes = VkDeviceSize{1} << 20;

}  // namespace

MemoryBlock::MemoryBlock(VkDevice device, const std::string& name, VkDeviceSize size,
                         std::uint32_t type, bool is_mapped)
    : type_(type), free_{{0, size}} {
    const VkMemoryAllocateInfo info = {
        .sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO,
        .allocationSize = size,
        .memoryTypeIndex = type,
    };
    VkDeviceMemory memory = VK_NULL_HANDLE;
    const VkResult result = vkAllocateMemory(device, &info, nullptr, &memory);
    if (result != VK_SUCCESS) {
        throw_result(result,
                     fmt::format("allocate {} bytes for the buffer '{}'", size, name).c_str());
    }
    memory_ = UniqueMemory(device, memory);
    if (!is_mapped) return;
    void* data = nullptr;
    check(vkMapMemory(device, memory, 0, VK_WHOLE_SIZE, 0, &data), "map a buffer");
    mapped_ = {static_cast<std::byte*>(data), static_cast<std::size_t>(size)};
}

VkDeviceSize MemoryBlock::take(VkDeviceSize size, VkDeviceSize alignment) {
    const std::scoped_lock lock(mutex_);
    // Each part may leave a range when it is given back, which must not throw.
    free_.reserve(free_.size() + part_count_ + 2);
    for (auto range = free_.begin(); range != free_.end(); ++range) {
        const Range whole = *range;
        const VkDeviceSize begin = (whole.begin + alignment - 1) / alignment * alignment;
        if (begin + size > whole.end) continue;
        auto at = free_.erase(range);
        if (begin + size < whole.end) at = free_.insert(at, {begin + size, whole.end});
        if (whole.begin < begin) free_.insert(at, {whole.begin, begin});
        ++part_count_;
        return begin;
    }
    return kNoRoom;
}

void MemoryBlock::give_back(VkDeviceSize offset, VkDeviceSize size) {
    const std::scoped_lock lock(mutex_);
    --part_count_;
    auto next = std::ranges::upper_bound(free_, offset, {}, &Range::begin);
    next = free_.insert(next, {offset, offset + size});
    if (next + 1 != free_.end() && next->end == (next + 1)->begin) {
        next->end = (next + 1)->end;
        free_.erase(next + 1);
    }
    if (next != free_.begin() && (next - 1)->end == next->begin) {
        (next - 1)->end = next->end;
        free_.erase(next);
    }
}

MemoryPart MemoryBlocks::take(VkDevice device, const std::string& name,
                              const VkMemoryRequirements& needs, std::uint32_t type,
                              bool is_mapped) {
    if (needs.size > kSmallBytes) {
        auto own = std::make_shared<MemoryBlock>(device, name, needs.size, type, is_mapped);
        own->take(needs.size, 1);
        return {std::move(own), 0, needs.size};
    }
    const std::scoped_lock lock(mutex_);
    std::erase_if(blocks_, [](const auto& block) { return block.expired(); });
    for (const std::weak_ptr<MemoryBlock>& candidate : blocks_) {
        std::shared_ptr<MemoryBlock> block = candidate.lock();
        if (block == nullptr || block->type() != type || block->mapped().empty() == is_mapped)
            continue;
        const VkDeviceSize offset = block->take(needs.size, needs.alignment);
        if (offset != MemoryBlock::kNoRoom) return {std::move(block), offset, needs.size};
    }
    auto block = std::make_shared<MemoryBlock>(device, name, kBlockBytes, type, is_mapped);
    blocks_.push_back(block);
    const VkDeviceSize offset = block->take(needs.size, needs.alignment);
    return {std::move(block), offset, needs.size};
}

}  // namespace mray::gpu
