// OpenEXR files of lit images.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "common/image/png.h"
#include "morphray/image.hpp"

namespace mray::app {

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
