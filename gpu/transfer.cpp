#include "gpu/transfer.h"

#include <algorithm>
#include <cassert>
#include <cstring>
#include <vector>

namespace mray::gpu {
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

void write_padded(std::span<const vec3> points, std::span<std::byte> out) {
    static_assert(sizeof(vec4) == kPaddedBytes);
    assert(out.size() == points.size() * kPaddedBytes);
    std::byte* to = out.data();
    for (const vec3& point : points) {
        const vec4 padded(point, 0.0f);
        std::memcpy(to, &padded, kPaddedBytes);
        to += kPaddedBytes;
    }
}

const Buffer& Transfer::staging() {
    if (staging_.get() == VK_NULL_HANDLE)
        staging_ = Buffer(context_.device(), "staging", kStagingBytes, 0, Memory::kHost);
    return staging_;
}

template <class Fill>
void Transfer::write(std::size_t size, const Buffer& to, Fill fill) {
    assert(size <= to.size());
    if (!to.mapped().empty()) {
        fill(to.mapped().first(size), 0);
        return;
    }
    for (std::size_t at = 0; at < size; at += kStagingBytes) {
        const std::size_t piece = std::min<std::size_t>(size - at, kStagingBytes);
        fill(staging().mapped().first(piece), at);
        copy(context_, staging(), 0, to, at, piece);
    }
}

void Transfer::upload(std::span<const std::byte> bytes, const Buffer& to) {
    if (bytes.empty()) return;
    write(bytes.size(), to, [&](std::span<std::byte> out, std::size_t at) {
        std::memcpy(out.data(), bytes.data() + at, out.size());
    });
}

void Transfer::upload_padded(std::span<const vec3> points, const Buffer& to) {
    static_assert(kStagingBytes % kPaddedBytes == 0);
    write(points.size() * kPaddedBytes, to, [&](std::span<std::byte> out, std::size_t at) {
        write_padded(points.subspan(at / kPaddedBytes, out.size() / kPaddedBytes), out);
    });
}

std::uint64_t Transfer::upload_changes(std::span<const std::byte> before,
                                       std::span<const std::byte> after, const Buffer& to) {
    assert(after.size() <= to.size());
    std::uint64_t written = 0;
    std::size_t staged = 0;
    std::vector<VkBufferCopy> copies;
    for (std::size_t at = 0; at < after.size(); at += kBlockBytes) {
        const std::size_t size = std::min(kBlockBytes, after.size() - at);
        if (at + size <= before.size() && std::memcmp(&before[at], &after[at], size) == 0) continue;
        written += size;
        if (!to.mapped().empty()) {
            std::memcpy(&to.mapped()[at], &after[at], size);
            continue;
        }
        if (staged + size > kStagingBytes) {
            copy_to(to, copies);
            copies.clear();
            staged = 0;
        }
        std::memcpy(&staging().mapped()[staged], &after[at], size);
        copies.push_back({.srcOffset = staged, .dstOffset = at, .size = size});
        staged += size;
    }
    if (!copies.empty()) copy_to(to, copies);
    return written;
}

void Transfer::copy_to(const Buffer& to, std::span<const VkBufferCopy> copies) {
    context_.submit("copy", [&](VkCommandBuffer commands) {
        vkCmdCopyBuffer(commands, staging().get(), to.get(),
                        static_cast<std::uint32_t>(copies.size()), copies.data());
    });
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
        copy(context_, from, at, staging(), 0, size);
        std::memcpy(bytes.data() + at, staging().mapped().data(), size);
    }
}

}  // namespace mray::gpu
