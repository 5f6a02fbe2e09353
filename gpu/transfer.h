// Between the host's memory and the device's.
#pragma once

#include "common/interop/platform.h"
#include "gpu/buffer.h"

namespace morphray::gpu {

/// Copies directly where the buffer is mapped, otherwise in pieces through a staging buffer.
class Transfer {
public:
    explicit Transfer(Context& context);

    /// Writes the bytes to the start of `to`.
    void upload(std::span<const std::byte> bytes, const Buffer& to);
    /// Writes points, each followed by a word of 0, to `to` from the place of point `first` on.
    void upload_padded(std::span<const vec3> points, const Buffer& to, std::size_t first = 0);
    /// Reads from the start of `from`.
    void download(const Buffer& from, std::span<std::byte> bytes);

private:
    /// Has `fill(bytes, offset)` write the `size` bytes that go to `to` from `begin` on, in pieces
    /// of whole kilobytes and a last one.
    template <class Fill>
    void write(std::size_t size, const Buffer& to, VkDeviceSize begin, Fill fill);

    Context& context_;
    Buffer staging_;
};

}  // namespace morphray::gpu
