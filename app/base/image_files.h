// Images in files: PNG and JPEG, also the textures of scenes, are read, OpenEXR is written.
#pragma once

#include <filesystem>

#include "app/base/messages.h"
#include "app/base/options.h"
#include "common/image/png.h"
#include "common/scene/mesh.h"

namespace mray::app {

/// The limits that a decoder checks before it allocates.
struct ImageLimits {
    std::uint32_t side = 65536;
    std::uint64_t pixels = std::uint64_t{1} << 28;
};

// These throw Error(kBadInput) for a damaged file, and Error(kLimit) above the limits; both name
// the file.

/// The stored pixels of a PNG file without corrections; grey and palettes become RGB.
Image decode_png(const std::string& bytes, const std::filesystem::path& path,
                 const ImageLimits& limits);
/// A JPEG file without colour profiles and turns by EXIF, the same on every machine. CMYK colours
/// are refused.
Image decode_jpeg(const std::string& bytes, const std::filesystem::path& path,
                  const ImageLimits& limits);
/// A PNG or JPEG image of at most 1 GiB, whatever its name.
Image read_texture(const TextureFile& file);

/// If lenient, an image that cannot be used is a warning and a white pixel.
std::vector<Image> read_textures(const SceneTextures& textures, bool lenient,
                                 const Messages& messages);

/// The image as an OpenEXR file in memory, with the channels of docs/guide/formats.md. Texts become
/// attributes. The bytes depend on the image and texts alone. Needs Image::linear.
std::string encode_exr(const morphray::Image& image, ExrColours colours,
                       std::span<const PngText> texts);

}  // namespace mray::app
