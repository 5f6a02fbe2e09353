#include "gpu/vulkan/memory.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>

#include "gpu/vulkan/device.h"

namespace mray::gpu {
namespace {

constexpr VkDeviceSize kBlockBytes = VkDeviceSize{8} << 20;
// Larger buffers have blocks of their own.
constexpr VkDeviceSize kSmallBytes = VkDeviceSize{1} << 20;

constexpr VkMemoryPropertyFlags kMapped =
    VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
constexpr VkMemoryPropertyFlags kCached = kMapped | VK_MEMORY_PROPERTY_HOST_CACHED_BIT;
constexpr VkMemoryPropertyFlags kLocal = VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT;

/// Memory types in order of preference. Vulkan guarantees the last of each list.
std::vector<VkMemoryPropertyFlags> preferences(Memory memory) {
    if (memory == Memory::kHost) return {kCached, kMapped};
    return {kLocal | kCached, kLocal, 0};
}

/// Rounds up to a multiple of 16 that is not a power of two. Lavapipe compiles a kernel again when
/// it first meets a texel buffer whose size is a power of two, which would disturb times.
VkDeviceSize padded_size(VkDeviceSize size) {
    const VkDeviceSize rounded = std::max<VkDeviceSize>((size + 15) / 16 * 16, 48);
    return std::has_single_bit(rounded) ? rounded + 16 : rounded;
}

UniqueBufferView texel_view(Device& device, const Buffer& buffer, VkFormat format) {
    const VkBufferViewCreateInfo info = {.sType = VK_STRUCTURE_TYPE_BUFFER_VIEW_CREATE_INFO,
                                         .buffer = buffer.get(),
                                         .format = format,
                                         .range = buffer.size()};
    return {device.get(), vkCreateBufferView, info, "create a buffer view"};
}

}  // namespace

MemoryRange MemoryBlocks::take(VkDevice device, const std::string& name,
                               const VkMemoryRequirements& needs, std::uint32_t type,
                               bool is_mapped) {
    const bool is_small = needs.size <= kSmallBytes;
    const std::scoped_lock lock(mutex_);
    std::weak_ptr<MemoryBlock>& last = last_[{type, is_mapped}];
    if (const auto block = last.lock(); block != nullptr && is_small) {
        const VkDeviceSize offset =
            (block->used + needs.alignment - 1) / needs.alignment * needs.alignment;
        if (offset + needs.size <= kBlockBytes) {
            block->used = offset + needs.size;
            return {block, offset};
        }
    }
    const VkMemoryAllocateInfo info = {.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO,
                                       .allocationSize = is_small ? kBlockBytes : needs.size,
                                       .memoryTypeIndex = type};
    const std::string action =
        fmt::format("allocate {} bytes for the buffer '{}'", info.allocationSize, name);
    const auto block = std::make_shared<MemoryBlock>();
    block->memory = {device, vkAllocateMemory, info, action.c_str()};
    block->used = needs.size;
    if (is_mapped) {
        void* data = nullptr;
        check(vkMapMemory(device, block->memory.get(), 0, VK_WHOLE_SIZE, 0, &data), "map a buffer");
        block->mapped = {static_cast<std::byte*>(data),
                         static_cast<std::size_t>(info.allocationSize)};
    }
    if (is_small) last = block;
    return {block, 0};
}

MemoryChoice choose_memory(const VkPhysicalDeviceMemoryProperties& properties,
                           std::uint32_t allowed_bits, Memory memory) {
    const VkMemoryPropertyFlags needed = memory == Memory::kHost ? kMapped : kCached;
    for (const VkMemoryPropertyFlags wanted : preferences(memory)) {
        for (std::uint32_t i = 0; i < properties.memoryTypeCount; ++i) {
            const VkMemoryPropertyFlags flags = properties.memoryTypes[i].propertyFlags;
            const bool is_allowed = (allowed_bits >> i & 1u) != 0;
            if (is_allowed && (flags & wanted) == wanted) return {i, (flags & needed) == needed};
        }
    }
    throw Error(ErrorKind::kUnavailable, "Vulkan: the device has no memory for buffers");
}

Buffer::Buffer(Device& device, const std::string& name, VkDeviceSize size, VkBufferUsageFlags usage,
               Memory memory)
    : size_(padded_size(size)) {
    const VkBufferCreateInfo info = {
        .sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO,
        .size = size_,
        .usage = usage | VK_BUFFER_USAGE_TRANSFER_SRC_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT,
        .sharingMode = VK_SHARING_MODE_EXCLUSIVE};
    buffer_ = UniqueBuffer(device.get(), vkCreateBuffer, info, "create a buffer");
    VkMemoryRequirements needs = {};
    vkGetBufferMemoryRequirements(device.get(), buffer_.get(), &needs);
    const MemoryChoice choice =
        choose_memory(device.physical().memory, needs.memoryTypeBits, memory);
    const bool is_staged = memory == Memory::kDevice && device.force_staging();
    const bool is_mapped = choice.is_mapped && !is_staged;
    memory_ = device.memory().take(device.get(), name, needs, choice.type, is_mapped);
    const MemoryBlock& block = *memory_.block;
    check(vkBindBufferMemory(device.get(), buffer_.get(), block.memory.get(), memory_.offset),
          "bind a buffer");
    if (is_mapped) mapped_ = block.mapped.subspan(memory_.offset, size_);
}

ReadBuffer::ReadBuffer(Device& device, BufferKind kind, const char* name, VkDeviceSize size,
                       VkFormat format, VkBufferUsageFlags usage, bool is_written) {
    const VkBufferUsageFlags texels = is_written ? VK_BUFFER_USAGE_STORAGE_TEXEL_BUFFER_BIT
                                                 : VK_BUFFER_USAGE_UNIFORM_TEXEL_BUFFER_BIT;
    const VkBufferUsageFlags storage = VK_BUFFER_USAGE_STORAGE_BUFFER_BIT;
    const bool is_texels = kind == BufferKind::kTexels;
    usage |= is_texels ? texels : storage;
    buffer = Buffer(device, name, size, usage, Memory::kDevice);
    if (is_texels) view = texel_view(device, buffer, format);
    if (is_texels && is_written) words = texel_view(device, buffer, VK_FORMAT_R32_UINT);
}

void ReadBuffer::bind(Bindings& bindings, std::uint32_t number, bool by_words) const {
    bindings.views[number] = (by_words ? words : view).get();
    bindings.buffers[number] = buffer.get();
}

}  // namespace mray::gpu
