// The options that images of render and view are made with, and the texts in their files.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "app/base/options.h"
#include "common/image/png.h"
#include "morphray/image.hpp"

namespace mray::app {

/// The options with the defaults of shading, samples and ambient occlusion filled in.
Options with_render_defaults(Options options);

/// The command that renders the image of a frame, on whatever backend; but for colours by a tree
/// that an update policy restructures after the frames before. The options are those of
/// with_render_defaults().
std::string render_command(const Options& options, double frame);
/// The same for the frames that the words `frames` choose, such as `--frames all`.
std::string render_command(const Options& options, const std::vector<std::string>& frames);

/// Return the texts of a PNG file, without or with its hits: nothing that differs between backends.
/// `scene_hash` is that of frame_hash().
std::vector<PngText> pixel_texts(const Options& options, double frame,
                                 std::span<const std::uint32_t> pixels);
std::vector<PngText> image_texts(const Options& options, double frame, std::uint64_t scene_hash,
                                 const morphray::Image& image);

/// The program and its version, as images name it.
std::string software_text();

}  // namespace mray::app
