#include "gpu/transfer.h"

#include <algorithm>
#include <cassert>
#include <cstring>
#include <vector>

namespace mray::gpu {
namespace {

constexpr VkDeviceSize kStagingBytes = VkDeviceSize{8} << 20;

}  // namespace

const Buffer& Transfer::staging() {
    if (staging_.get() == VK_NULL_HANDLE)
        staging_ = Buffer(context_.device(), "staging", kStagingBytes, 0, Memory::kHost);
    return staging_;
}

void Transfer::upload(std::span<const std::byte> bytes, const Buffer& to) {
    assert(bytes.size() <= to.size());
    if (to.mapped().empty()) {
        upload_changes({}, bytes, to);
    } else if (!bytes.empty()) {
        std::memcpy(to.mapped().data(), bytes.data(), bytes.size());
    }
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
            copy(staging(), to, copies);
            copies.clear();
            staged = 0;
        }
        std::memcpy(&staging().mapped()[staged], &after[at], size);
        if (!copies.empty() && copies.back().dstOffset + copies.back().size == at) {
            copies.back().size += size;
        } else {
            copies.push_back({.srcOffset = staged, .dstOffset = at, .size = size});
        }
        staged += size;
    }
    if (!copies.empty()) copy(staging(), to, copies);
    return written;
}

void Transfer::copy(const Buffer& from, const Buffer& to, std::span<const VkBufferCopy> copies) {
    run([&](VkCommandBuffer commands) {
        vkCmdCopyBuffer(commands, from.get(), to.get(), static_cast<std::uint32_t>(copies.size()),
                        copies.data());
    });
}

void Transfer::run(const Record& copy) {
    if (copy) context_.submit("copy", copy);
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
        const VkBufferCopy piece = {.srcOffset = at, .dstOffset = 0, .size = size};
        copy(from, staging(), std::span(&piece, 1));
        std::memcpy(bytes.data() + at, staging().mapped().data(), size);
    }
}

}  // namespace mray::gpu
