#include "gpu/vulkan/memory.h"

#include <fmt/format.h>

#include <algorithm>

#include "gpu/vulkan/result.h"

namespace mray::gpu {
namespace {

constexpr VkDeviceSize kBlockBytes = VkDeviceSize{8} << 20;
/// Buffers above it have allocations of their own.
constexpr VkDeviceSize kSmallBytes = VkDeviceSize{1} << 20;

std::shared_ptr<MemoryBlock> allocate(VkDevice device, const std::string& name, VkDeviceSize size,
                                      std::uint32_t type, bool is_mapped) {
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
    auto block = std::make_shared<MemoryBlock>();
    block->memory = UniqueMemory(device, memory);
    block->type = type;
    block->size = size;
    if (!is_mapped) return block;
    void* data = nullptr;
    check(vkMapMemory(device, memory, 0, VK_WHOLE_SIZE, 0, &data), "map a buffer");
    block->mapped = {static_cast<std::byte*>(data), static_cast<std::size_t>(size)};
    return block;
}

}  // namespace

MemoryPart MemoryBlocks::take(VkDevice device, const std::string& name,
                              const VkMemoryRequirements& needs, std::uint32_t type,
                              bool is_mapped) {
    if (needs.size > kSmallBytes) return {allocate(device, name, needs.size, type, is_mapped), 0};
    const std::scoped_lock lock(mutex_);
    const auto is_open = [&](const std::weak_ptr<MemoryBlock>& candidate) {
        const std::shared_ptr<MemoryBlock> block = candidate.lock();
        return block != nullptr && block->type == type && block->mapped.empty() != is_mapped;
    };
    const auto place = std::ranges::find_if(open_, is_open);
    std::shared_ptr<MemoryBlock> block = place != open_.end() ? place->lock() : nullptr;
    const auto aligned = [&] {
        return (block->used + needs.alignment - 1) / needs.alignment * needs.alignment;
    };
    if (block == nullptr || aligned() + needs.size > block->size) {
        block = allocate(device, name, kBlockBytes, type, is_mapped);
        std::erase_if(open_, [&](const auto& old) { return old.expired() || is_open(old); });
        open_.push_back(block);
    }
    const VkDeviceSize offset = aligned();
    block->used = offset + needs.size;
    return {std::move(block), offset};
}

}  // namespace mray::gpu
