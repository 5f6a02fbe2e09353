// Images in files: PNG and JPEG, also the textures of scenes, are read, OpenEXR is written.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "app/terminal/messages.h"
#include "common/image/png.h"
#include "common/scene/textures.h"
#include "morphray/images.hpp"

namespace mray::app {

/// The limits that a decoder checks before it allocates.
struct ImageLimits {
    std::uint32_t side = 65536;
    std::uint64_t pixels = std::uint64_t{1} << 28;

    /// Throws Error(kLimit), with the file, for more pixels.
    void require(const std::filesystem::path& path, std::uint64_t width,
                 std::uint64_t height) const;
};

/// Whether the bytes begin as a PNG file does.
bool is_png(std::string_view bytes);

/// An image and the texts that stand before its pixels.
struct PngFile {
    Image image;
    std::vector<PngText> texts;

    /// The text with this keyword, or an empty one.
    std::string text(std::string_view keyword) const;
};

/// The stored pixels of a PNG file, without corrections; grey and palettes become RGB, missing
/// alpha 255, 16 bits a channel 8. Throws Error: kBadInput for a file that is no PNG or is damaged
/// (any wrong checksum, texts included); kLimit above the limits.
PngFile decode_png(const std::string& bytes, const std::filesystem::path& path,
                   const ImageLimits& limits);

/// Whether the bytes begin as a JPEG file does.
bool is_jpeg(std::string_view bytes);

/// The pixels of a JPEG file, grey as RGB, without colour profiles and turns by EXIF, the same on
/// every machine. Throws Error: kBadInput for a file that is no JPEG, is damaged, ends too early or
/// has CMYK colours; kLimit above the limits.
Image decode_jpeg(const std::string& bytes, const std::filesystem::path& path,
                  const ImageLimits& limits);

/// The bytes of a file, of a part of one, or of base 64 text. Throws Error: kBadInput if that
/// cannot be read, kLimit above 1 GiB.
std::string texture_bytes(const TextureFile& file);

/// A PNG or JPEG image, whatever its name. Throws Error: kBadInput for another kind and a damaged
/// one, kLimit for more pixels than a texture may have or than there is memory for.
Image read_texture(const TextureFile& file);

/// If lenient, an image that cannot be used is a warning and a white pixel.
std::vector<Image> read_textures(const SceneTextures& textures, bool lenient,
                                 const Messages& messages);

enum class ExrColours { kHalf, kFloat };

/// The image as an OpenEXR file in memory, with these layers:
///
///   R, G, B              linear colours, half or float
///   normal.X Y Z         unit normals in world space, half; 0 without a hit
///   occlusion.Y          the share of the sky that is hidden, half
///   depth.Z              along the viewing direction, in world space, float;
///                        infinite without a hit
///   barycentric.U V      of the hit, float
///   id.prim, id.geom     of the hit, uint; 2^32 - 1 without one
///
/// All but colours are those of the sample in the middle of a pixel. Texts become attributes. The
/// bytes depend on the image and texts alone. Needs Image::lit_pixels.
std::vector<std::byte> encode_exr(const morphray::Image& image, ExrColours colours,
                                  std::span<const PngText> texts);

}  // namespace mray::app
