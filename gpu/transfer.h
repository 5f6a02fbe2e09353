// Copies between the host's memory and the device's.
#pragma once

#include "common/interop/platform.h"
#include "gpu/vulkan/buffer.h"
#include "gpu/vulkan/context.h"

namespace mray::gpu {

/// Bytes of a position on the device.
inline constexpr std::size_t kPaddedBytes = 16;
/// Writes points, each followed by a word of 0; `out` has kPaddedBytes a point.
void write_padded(std::span<const vec3> points, std::span<std::byte> out);

/// Copies directly if a buffer is mapped, otherwise in pieces through a staging buffer, which is
/// made when it is first needed.
class Transfer {
public:
    explicit Transfer(Context& context) : context_(context) {}

    /// Writes bytes to the start of `to`.
    void upload(std::span<const std::byte> bytes, const Buffer& to);
    /// write_padded() to the start of `to`.
    void upload_padded(std::span<const vec3> points, const Buffer& to);
    /// Changes the start of `to` from `before` to `after`: writes the blocks of kBlockBytes that
    /// differ. Returns the number of bytes that it wrote.
    std::uint64_t upload_changes(std::span<const std::byte> before,
                                 std::span<const std::byte> after, const Buffer& to);
    static constexpr std::size_t kBlockBytes = 2048;
    /// Reads bytes from the start of `from`.
    void download(const Buffer& from, std::span<std::byte> bytes);

private:
    /// Has `fill(bytes, at)` write the first `size` bytes of `to`, in pieces of whole kilobytes and
    /// a last one; `at` is the offset of a piece.
    template <class Fill>
    void write(std::size_t size, const Buffer& to, Fill fill);

    void copy_to(const Buffer& to, std::span<const VkBufferCopy> copies);
    const Buffer& staging();

    Context& context_;
    Buffer staging_;
};

}  // namespace mray::gpu
