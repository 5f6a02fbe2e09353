// How large images may be that are read from files.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace mray::app {

/// The limits that a decoder checks before it allocates.
struct ImageLimits {
    std::uint32_t side = 65536;
    std::uint64_t pixels = std::uint64_t{1} << 28;
    /// Reduce channels of 16 bits to 8 instead of refusing them.
    bool reduce_16_bits = false;

    /// Throws Error(kLimit), with the file, for more pixels.
    void require(const std::filesystem::path& path, std::uint64_t width,
                 std::uint64_t height) const;
};

}  // namespace mray::app
