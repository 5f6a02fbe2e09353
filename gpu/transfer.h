// Between the host's memory and the device's.
#pragma once

#include "gpu/buffer.h"

namespace morphray::gpu {

/// Copies directly where the buffer is mapped, otherwise in pieces through a staging buffer.
class Transfer {
public:
    explicit Transfer(Context& context);

    /// Writes the bytes to `to` from `offset` on.
    void upload(std::span<const std::byte> bytes, const Buffer& to, VkDeviceSize offset = 0);
    /// Reads from the start of `from`.
    void download(const Buffer& from, std::span<std::byte> bytes);

private:
    Context& context_;
    Buffer staging_;
};

}  // namespace morphray::gpu
