// Copies between the host's memory and the device's.
#pragma once

#include <algorithm>
#include <cassert>
#include <cstring>

#include "gpu/vulkan/buffer.h"
#include "gpu/vulkan/context.h"

namespace mray::gpu {

/// Copies directly if a buffer is mapped, otherwise in pieces through a staging buffer.
class Transfer {
public:
    explicit Transfer(Context& context) : context_(context) {}

    /// Writes bytes to the start of `to`.
    void upload(std::span<const std::byte> bytes, const Buffer& to) {
        assert(bytes.size() <= to.size());
        if (bytes.empty()) return;
        if (!to.mapped().empty()) {
            std::memcpy(to.mapped().data(), bytes.data(), bytes.size());
            return;
        }
        for (std::size_t at = 0; at < bytes.size(); at += kStagingBytes) {
            const std::size_t size = std::min<std::size_t>(bytes.size() - at, kStagingBytes);
            std::memcpy(staging().mapped().data(), bytes.data() + at, size);
            copy(staging(), to, {.srcOffset = 0, .dstOffset = at, .size = size});
        }
    }

    /// Reads bytes from the start of `from`.
    void download(const Buffer& from, std::span<std::byte> bytes) {
        assert(bytes.size() <= from.size());
        if (bytes.empty()) return;
        if (!from.mapped().empty()) {
            std::memcpy(bytes.data(), from.mapped().data(), bytes.size());
            return;
        }
        for (std::size_t at = 0; at < bytes.size(); at += kStagingBytes) {
            const std::size_t size = std::min<std::size_t>(bytes.size() - at, kStagingBytes);
            copy(from, staging(), {.srcOffset = at, .dstOffset = 0, .size = size});
            std::memcpy(bytes.data() + at, staging().mapped().data(), size);
        }
    }

    /// Submits commands of a copy, if there are any.
    void run(const Record& copy) {
        if (copy) context_.submit("copy", copy);
    }

private:
    static constexpr VkDeviceSize kStagingBytes = VkDeviceSize{8} << 20;

    void copy(const Buffer& from, const Buffer& to, const VkBufferCopy& piece) {
        run([&](VkCommandBuffer commands) {
            vkCmdCopyBuffer(commands, from.get(), to.get(), 1, &piece);
        });
    }

    const Buffer& staging() {
        if (staging_.get() == VK_NULL_HANDLE)
            staging_ = Buffer(context_.device(), "staging", kStagingBytes, 0, Memory::kHost);
        return staging_;
    }

    Context& context_;
    Buffer staging_;
};

}  // namespace mray::gpu
