// Images in files: PNG and JPEG, also the textures of scenes, are read, OpenEXR is written.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "app/base/messages.h"
#include "common/image/png.h"
#include "common/scene/mesh.h"
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

/// Throws Error(kBadInput), or std::bad_alloc if a decoder says so of memory. `format`: "PNG".
[[noreturn]] void refuse_image(const std::filesystem::path& path, const char* format,
                               const std::string& what);

bool is_png(std::string_view bytes);

/// Reads the stored pixels of a PNG file without corrections; grey and palettes become RGB. Throws
/// Error: kBadInput for a damaged file, also in its texts; kLimit above the limits.
Image decode_png(const std::string& bytes, const std::filesystem::path& path,
                 const ImageLimits& limits);

bool is_jpeg(std::string_view bytes);

/// Reads a JPEG file without colour profiles and turns by EXIF, the same on every machine. Throws
/// Error: kBadInput for a damaged file and for CMYK colours; kLimit above the limits.
Image decode_jpeg(const std::string& bytes, const std::filesystem::path& path,
                  const ImageLimits& limits);

/// Throws Error: kBadInput if the bytes cannot be read, kLimit above 1 GiB.
std::string texture_bytes(const TextureFile& file);

/// Reads a PNG or JPEG image, whatever its name. Throws Error: kBadInput, and kLimit for more
/// pixels than a texture may have.
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
