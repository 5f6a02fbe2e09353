// Reading of JPEG files.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "app/files/image_limits.h"
#include "common/image/png.h"

namespace mray::app {

/// Whether the bytes begin as a JPEG file does.
bool is_jpeg(std::string_view bytes);

/// The pixels of a JPEG file in memory, grey as RGB, without corrections by a colour profile and
/// without turns by EXIF. `path` is for messages. The same on every machine: transformed by the
/// accurate integer method, chroma repeated where it has fewer samples. Throws Error: kBadInput for
/// a file that is no JPEG, is damaged, ends too early or has CMYK colours; kLimit above the limits.
Image decode_jpeg(const std::string& bytes, const std::filesystem::path& path,
                  const ImageLimits& limits);

}  // namespace mray::app
