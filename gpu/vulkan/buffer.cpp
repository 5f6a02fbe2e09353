#include "gpu/vulkan/buffer.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <optional>
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
VkDeviceSize padded(VkDeviceSize size) {
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

Buffer::Buffer(Context& context, const std::string& name, VkDeviceSize size,
               VkBufferUsageFlags usage, Memory memory)
    : size_(padded(size)) {
    const VkBufferCreateInfo info = {
        .sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO,
        .size = size_,
        .usage = usage | VK_BUFFER_USAGE_TRANSFER_SRC_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT,
        .sharingMode = VK_SHARING_MODE_EXCLUSIVE,
    };
    VkBuffer buffer = VK_NULL_HANDLE;
    check(vkCreateBuffer(context.device(), &info, nullptr, &buffer), "create a buffer");
    buffer_ = UniqueBuffer(context.device(), buffer);
    context.name(VK_OBJECT_TYPE_BUFFER, buffer, name);

    VkMemoryRequirements needs = {};
    vkGetBufferMemoryRequirements(context.device(), buffer, &needs);
    const MemoryChoice choice =
        choose_memory(context.physical().memory, needs.memoryTypeBits, memory);
    const VkMemoryAllocateFlagsInfo has_address = {
        .sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_FLAGS_INFO,
        .flags = VK_MEMORY_ALLOCATE_DEVICE_ADDRESS_BIT,
    };
    const VkMemoryAllocateInfo allocation = {
        .sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO,
        .pNext = (usage & VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT) != 0 ? &has_address : nullptr,
        .allocationSize = needs.size,
        .memoryTypeIndex = choice.type,
    };
    VkDeviceMemory device_memory = VK_NULL_HANDLE;
    const VkResult result =
        vkAllocateMemory(context.device(), &allocation, nullptr, &device_memory);
    if (result != VK_SUCCESS) {
        throw_result(
            result, fmt::format("allocate {} bytes for the buffer '{}'", needs.size, name).c_str());
    }
    memory_ = UniqueMemory(context.device(), device_memory);
    check(vkBindBufferMemory(context.device(), buffer, device_memory, 0), "bind a buffer");

    const bool is_staged = memory == Memory::kDevice && context.force_staging();
    if (!choice.is_mapped || is_staged) return;
    void* data = nullptr;
    check(vkMapMemory(context.device(), device_memory, 0, VK_WHOLE_SIZE, 0, &data), "map a buffer");
    mapped_ = {static_cast<std::byte*>(data), static_cast<std::size_t>(size_)};
}

UniqueBufferView texel_view(Context& context, const std::string& name, const Buffer& buffer,
                            VkFormat format) {
    const VkBufferViewCreateInfo info = {
        .sType = VK_STRUCTURE_TYPE_BUFFER_VIEW_CREATE_INFO,
        .buffer = buffer.get(),
        .format = format,
        .offset = 0,
        .range = buffer.size(),
    };
    VkBufferView view = VK_NULL_HANDLE;
    check(vkCreateBufferView(context.device(), &info, nullptr, &view), "create a buffer view");
    UniqueBufferView owner(context.device(), view);
    context.name(VK_OBJECT_TYPE_BUFFER_VIEW, view, name);
    return owner;
}

}  // namespace mray::gpu
