#include "gpu/position_ring.h"

#include <cassert>
#include <utility>

#include "gpu/vulkan/transfer.h"

namespace morphray::gpu {

Record PositionRing::write(Context& context, std::span<const vec3> positions,
                           std::span<const IndexRange> ranges, const Buffer& to) {
    assert(positions.size() == vertex_count_);
    Buffer& slot = slots_[std::exchange(next_, next_ ^ 1u)];
    if (slot.get() == VK_NULL_HANDLE) {
        slot = Buffer(context, "positions, on their way", kPaddedBytes * vertex_count_, 0,
                      Memory::kHost);
    }
    std::vector<VkBufferCopy> copies;
    for (const IndexRange range : ranges) {
        const std::size_t count = range.end - range.begin;
        const VkDeviceSize begin = kPaddedBytes * range.begin;
        const VkDeviceSize size = kPaddedBytes * count;
        write_padded(positions.subspan(range.begin, count), slot.mapped().subspan(begin, size));
        copies.push_back({.srcOffset = begin, .dstOffset = begin, .size = size});
    }
    return
        [copies = std::move(copies), from = slot.get(), to = to.get()](VkCommandBuffer commands) {
            vkCmdCopyBuffer(commands, from, to, static_cast<std::uint32_t>(copies.size()),
                            copies.data());
            // Writer: the copy; reader: kernels.
            barrier(commands, VK_PIPELINE_STAGE_TRANSFER_BIT, VK_ACCESS_TRANSFER_WRITE_BIT,
                    VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT, VK_ACCESS_SHADER_READ_BIT);
        };
}

}  // namespace morphray::gpu
