#include "gpu/vulkan/buffer.h"

#include <algorithm>
#include <bit>
#include <vector>

#include "gpu/vulkan/result.h"

namespace mray::gpu {
namespace {

constexpr VkMemoryPropertyFlags kMapped =
    VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
constexpr VkMemoryPropertyFlags kCached = kMapped | VK_MEMORY_PROPERTY_HOST_CACHED_BIT;
constexpr VkMemoryPropertyFlags kLocal = VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT;

/// Memory types in order of preference. Vulkan guarantees the last one of each list.
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

}  // namespace

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
        .sharingMode = VK_SHARING_MODE_EXCLUSIVE,
    };
    buffer_ = UniqueBuffer(device.get(), vkCreateBuffer, info, "create a buffer");
    const VkBuffer buffer = buffer_.get();

    VkMemoryRequirements needs = {};
    vkGetBufferMemoryRequirements(device.get(), buffer, &needs);
    const MemoryChoice choice =
        choose_memory(device.physical().memory, needs.memoryTypeBits, memory);
    const bool is_staged = memory == Memory::kDevice && device.force_staging();
    const bool is_mapped = choice.is_mapped && !is_staged;
    memory_ = device.memory().take(device.get(), name, needs, choice.type, is_mapped);
    check(vkBindBufferMemory(device.get(), buffer, memory_.block().get(), memory_.offset()),
          "bind a buffer");
    if (is_mapped) mapped_ = memory_.block().mapped().subspan(memory_.offset(), size_);
}

UniqueBufferView texel_view(Device& device, const Buffer& buffer, VkFormat format) {
    const VkBufferViewCreateInfo info = {
        .sType = VK_STRUCTURE_TYPE_BUFFER_VIEW_CREATE_INFO,
        .buffer = buffer.get(),
        .format = format,
        .offset = 0,
        .range = buffer.size(),
    };
    return {device.get(), vkCreateBufferView, info, "create a buffer view"};
}

}  // namespace mray::gpu
