// Reading of PNG files.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "app/files/image_limits.h"
#include "common/image/png.h"

namespace mray::app {

/// Whether the name ends in .png, in any case.
bool is_png_name(const std::filesystem::path& path);

/// Whether the bytes begin as a PNG file does.
bool is_png(std::string_view bytes);

/// The pixels of a PNG file in memory, as they are stored, without corrections of gamma or colour;
/// grey and palettes become RGB, missing alpha becomes 255. `path` is for messages. Throws Error:
/// kBadInput for a file that is no PNG, is damaged (any chunk with a wrong checksum, texts
/// included) or, unless the limits say otherwise, has 16 bits a channel; kLimit above the limits.
Image decode_png(const std::string& bytes, const std::filesystem::path& path,
                 const ImageLimits& limits);

/// The same for a file. Throws also what read_input_file() throws.
Image read_png(const std::filesystem::path& path);

/// An image and the texts of its file.
struct PngFile {
    Image image;
    std::vector<PngText> texts;

    /// The text with this keyword, or an empty one.
    std::string text(std::string_view keyword) const;
};

/// As read_png(), with the texts that stand before the pixels.
PngFile read_png_file(const std::filesystem::path& path);

}  // namespace mray::app
