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

/// The pixels of a PNG file in memory, as they are stored, without corrections of gamma or colour;
/// grey and palettes become RGB, missing alpha becomes 255, 16 bits a channel 8. `path` is for
/// messages. Throws Error: kBadInput for a file that is no PNG or is damaged (any chunk with a
/// wrong checksum, texts included); kLimit above the limits.
PngFile decode_png(const std::string& bytes, const std::filesystem::path& path,
                   const ImageLimits& limits);

/// Whether the bytes begin as a JPEG file does.
bool is_jpeg(std::string_view bytes);

/// The pixels of a JPEG file in memory, grey as RGB, without corrections by a colour profile and
/// without turns by EXIF. `path` is for messages. The same on every machine: transformed by the
/// accurate integer method, chroma repeated where it has fewer samples. Throws Error: kBadInput for
/// a file that is no JPEG, is damaged, ends too early or has CMYK colours; kLimit above the limits.
Image decode_jpeg(const std::string& bytes, const std::filesystem::path& path,
                  const ImageLimits& limits);

/// The bytes of an image: of a file, of a part of one, or of what stands in one in base 64. Throws
/// Error: kBadInput for a file that cannot be read or does not have that part, and for a part above
/// 1 GiB; kLimit for a file above 1 GiB.
std::string texture_bytes(const TextureFile& file);

/// The image in a PNG or JPEG file, whatever its name, or in a part of any file. Throws Error:
/// kBadInput for an image of another kind and for a damaged one, kLimit for more pixels than a
/// texture may have or than there is memory for.
Image read_texture(const TextureFile& file);

/// The images of all textures, in their order. If lenient, one that cannot be used is a warning and
/// a white pixel; otherwise throws what read_texture() throws.
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
