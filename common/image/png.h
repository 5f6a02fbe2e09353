// Images and their PNG files.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace mray {

/// 8-bit RGBA pixels, row by row from the top, R in bits 0-7 of each.
struct Image {
    std::uint32_t width = 0;
    std::uint32_t height = 0;
    std::vector<std::uint32_t> pixels;
};

/// The image as a PNG file in memory.
std::vector<std::byte> encode_png(const Image& image);

/// All images, which have one size, scaled down by a whole factor and laid out in rows, so that the
/// sheet is at most about max_width wide. Empty for no images.
Image contact_sheet(std::span<const Image> images, std::uint32_t max_width = 1536);

}  // namespace mray
