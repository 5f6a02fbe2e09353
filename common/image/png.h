// Images and their PNG files.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace mray {

/// 8-bit RGBA pixels, row by row from the top, R in bits 0-7 of each.
struct Image {
    std::uint32_t width = 0;
    std::uint32_t height = 0;
    std::vector<std::uint32_t> pixels;
};

/// A text of a PNG file, UTF-8 without NUL; its keyword has 1 to 79 letters, digits and blanks.
struct PngText {
    std::string keyword, text;
};

/// The image as a PNG file in memory, with texts as iTXt chunks.
std::vector<std::byte> encode_png(const Image& image, std::span<const PngText> texts = {});

}  // namespace mray
