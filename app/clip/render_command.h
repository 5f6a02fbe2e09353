// The texts in the files of images: how they were made.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "app/base/options.h"
#include "common/image/png.h"
#include "morphray/image.hpp"

namespace mray::app {

/// The command that renders the image of a frame, on whatever backend; but for colours by a tree
/// that an update policy restructures after the frames before.
std::string render_command(const ImageOptions& options, double frame);

/// Returns the texts of a PNG file: nothing that differs between backends. `scene_hash` is that of
/// frame_hash().
std::vector<PngText> image_texts(const ImageOptions& options, double frame,
                                 std::uint64_t scene_hash, const morphray::Image& image);

/// The program and its version, as images name it.
std::string software_text();

}  // namespace mray::app
