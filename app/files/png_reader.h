// Reading of PNG files.
#pragma once

#include <filesystem>

#include "common/image/png.h"

namespace mray::app {

/// Whether the name ends in .png, in any case.
bool is_png_name(const std::filesystem::path& path);

/// The pixels as they are stored, without corrections of gamma or colour; grey and palettes become
/// RGB, missing alpha becomes 255. Throws Error: kBadInput for a file that cannot be read, is no
/// PNG, is damaged or has 16 bits a channel; kLimit for more than 65536 pixels a side or 2^28 in
/// all.
Image read_png(const std::filesystem::path& path);

}  // namespace mray::app
