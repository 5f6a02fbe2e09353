#include "gpu/transfer.h"

#include <algorithm>
#include <cassert>
#include <cstring>

namespace morphray::gpu {
namespace {

constexpr VkDeviceSize kStagingBytes = VkDeviceSize{8} << 20;

void copy(Context& context, const Buffer& from, VkDeviceSize from_offset, const Buffer& to,
          VkDeviceSize to_offset, VkDeviceSize size) {
    context.submit("copy", [&](VkCommandBuffer commands) {
        const VkBufferCopy region = {
            .srcOffset = from_offset, .dstOffset = to_offset, .size = size};
        vkCmdCopyBuffer(commands, from.get(), to.get(), 1, &region);
    });
}

}  // namespace

Transfer::Transfer(Context& context)
    : context_(context), staging_(context, "staging", kStagingBytes, 0, Memory::kHost) {}

void Transfer::upload(std::span<const std::byte> bytes, const Buffer& to, VkDeviceSize offset) {
    assert(offset + bytes.size() <= to.size());
    if (bytes.empty()) return;
    if (!to.mapped().empty()) {
        std::memcpy(to.mapped().data() + offset, bytes.data(), bytes.size());
        return;
    }
    for (std::size_t at = 0; at < bytes.size(); at += kStagingBytes) {
        const std::size_t size = std::min<std::size_t>(bytes.size() - at, kStagingBytes);
        std::memcpy(staging_.mapped().data(), bytes.data() + at, size);
        copy(context_, staging_, 0, to, offset + at, size);
    }
}

void Transfer::download(const Buffer& from, std::span<std::byte> bytes) {
    assert(bytes.size() <= from.size());
    if (bytes.empty()) return;
    if (!from.mapped().empty()) {
        std::memcpy(bytes.data(), from.mapped().data(), bytes.size());
        return;
    }
    for (std::size_t at = 0; at < bytes.size(); at += kStagingBytes) {
        const std::size_t size = std::min<std::size_t>(bytes.size() - at, kStagingBytes);
        copy(context_, from, at, staging_, 0, size);
        std::memcpy(bytes.data() + at, staging_.mapped().data(), size);
    }
}

}  // namespace morphray::gpu
