// Copies between the host's memory and the device's.
#pragma once

#include "gpu/vulkan/buffer.h"
#include "gpu/vulkan/context.h"

namespace mray::gpu {

/// Copies directly if a buffer is mapped, otherwise in pieces through a staging buffer, which is
/// made when it is first needed.
class Transfer {
public:
    explicit Transfer(Context& context) : context_(context) {}

    void upload(std::span<const std::byte> bytes, const Buffer& to);
    void download(const Buffer& from, std::span<std::byte> bytes);
    void run(const Record& copy);

private:
    void copy(const Buffer& from, const Buffer& to, const VkBufferCopy& piece);
    const Buffer& staging();

    Context& context_;
    Buffer staging_;
};

}  // namespace mray::gpu
