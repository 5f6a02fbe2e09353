// How large images may be that are read from files.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace mray::app {

/// Memory that a decoder takes without asking whether it is there, which takes longer than to
/// decode a small image.
inline constexpr std::uint64_t kAlwaysThere = std::uint64_t{4} << 20;

/// The limits that a decoder checks before it allocates.
struct ImageLimits {
    std::uint32_t side = 65536;
    std::uint64_t pixels = std::uint64_t{1} << 28;
    /// Bytes that a pixel takes besides the memory of the decoder itself.
    std::uint64_t bytes_per_pixel = 4;
    /// Reduce channels of 16 bits to 8 instead of refusing them.
    bool reduce_16_bits = false;

    /// Throws Error(kLimit), with the file, for more pixels, and if the memory will not suffice for
    /// them and they take more than kAlwaysThere. decoder_bytes: what the decoder takes for a
    /// pixel.
    void require(const std::filesystem::path& path, std::uint64_t width, std::uint64_t height,
                 std::uint64_t decoder_bytes = 0) const;
};

}  // namespace mray::app
