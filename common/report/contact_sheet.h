// Many images in one.
#pragma once

#include <cstdint>
#include <span>

#include "common/image/png.h"

namespace mray {

/// All images, which have one size, scaled down by a whole factor and laid out in rows, so that the
/// sheet is at most about max_width wide. Empty for no images.
Image contact_sheet(std::span<const Image> images, std::uint32_t max_width = 1536);

}  // namespace mray
