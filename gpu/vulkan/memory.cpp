#include "gpu/vulkan/memory.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>

#include "gpu/vulkan/device.h"

namespace mray::gpu {
namespace {

constexpr VkDeviceSize kBlockBytes = VkDeviceSize{8} << 20;
/// Larger buffers have blocks of their own.
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

MemoryBlock::MemoryBlock(VkDevice device, const std::string& name, VkDeviceSize size,
                         std::uint32_t type, bool is_mapped)
    : type_(type), free_{{0, size}} {
    const VkMemoryAllocateInfo info = {.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO,
                                       .allocationSize = size,
                                       .memoryTypeIndex = type};
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
    // give_back() may add a free range for each used one, and must not throw.
    free_.reserve(free_.size() + range_count_ + 2);
    for (auto range = free_.begin(); range != free_.end(); ++range) {
        const Range whole = *range;
        const VkDeviceSize begin = (whole.begin + alignment - 1) / alignment * alignment;
        if (begin + size > whole.end) continue;
        auto at = free_.erase(range);
        if (begin + size < whole.end) at = free_.insert(at, {begin + size, whole.end});
        if (whole.begin < begin) free_.insert(at, {whole.begin, begin});
        ++range_count_;
        return begin;
    }
    return kNoSpace;
}

void MemoryBlock::give_back(VkDeviceSize offset, VkDeviceSize size) {
    const std::scoped_lock lock(mutex_);
    --range_count_;
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

std::unique_ptr<const MemoryRange> MemoryBlocks::take(VkDevice device, const std::string& name,
                                                      const VkMemoryRequirements& needs,
                                                      std::uint32_t type, bool is_mapped) {
    const auto take_from = [&](std::shared_ptr<MemoryBlock> block) {
        auto range = std::make_unique<MemoryRange>(needs.size);
        range->offset = block->take(needs.size, needs.alignment);
        if (range->offset == MemoryBlock::kNoSpace) return std::unique_ptr<const MemoryRange>();
        // From here on the range gives the bytes back.
        range->block = std::move(block);
        return std::unique_ptr<const MemoryRange>(std::move(range));
    };
    if (needs.size > kSmallBytes)
        return take_from(std::make_shared<MemoryBlock>(device, name, needs.size, type, is_mapped));
    const std::scoped_lock lock(mutex_);
    std::erase_if(blocks_, [](const auto& block) { return block.expired(); });
    for (const std::weak_ptr<MemoryBlock>& candidate : blocks_) {
        const std::shared_ptr<MemoryBlock> block = candidate.lock();
        if (block == nullptr || block->type() != type || block->mapped().empty() == is_mapped)
            continue;
        if (auto range = take_from(block)) return range;
    }
    auto block = std::make_shared<MemoryBlock>(device, name, kBlockBytes, type, is_mapped);
    blocks_.push_back(block);
    return take_from(std::move(block));
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
    check(vkBindBufferMemory(device.get(), buffer_.get(), memory_->block->get(), memory_->offset),
          "bind a buffer");
    if (is_mapped) mapped_ = memory_->block->mapped().subspan(memory_->offset, size_);
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
