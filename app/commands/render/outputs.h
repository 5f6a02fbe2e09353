// The files that a render writes, and their texts.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "app/base/options.h"
#include "common/image/png.h"
#include "morphray/images.hpp"
#include "scenes/animation.h"

namespace mray::app {

struct FrameTask {
    double frame = 0;
    std::string file;
};

/// The folder that --out means; of one image its folder.
std::filesystem::path output_folder_of(const RenderOptions& options);

/// The images of these frames. Throws Error(kBadArgument) if two frames would have one file.
std::vector<FrameTask> frame_tasks(const RenderOptions& options, const std::vector<double>& frames,
                                   const Animation& animation);

/// The OpenEXR file of a task. Empty: none.
std::filesystem::path exr_file_of(const RenderOptions& options, const std::filesystem::path& folder,
                                  const FrameTask& task);

/// XXH3 (64 bits) of what all frames share, with `with_textures` also of texture coordinates and
/// files. Throws Error(kBadInput) for a texture that cannot be read, unless it is missing and
/// `lenient`.
std::uint64_t animation_hash(const Animation& animation, bool with_textures, bool lenient);

/// The same for one frame: of a animation_hash() and the positions of all vertices.
std::uint64_t frame_hash(std::uint64_t animation_hash, std::span<const vec3> positions);

/// The texts of a PNG file: nothing that differs between backends. `scene_hash` is frame_hash(),
/// `scale` scale_text().
std::vector<PngText> image_texts(const ImageOptions& options, double frame,
                                 std::uint64_t scene_hash, const std::string& scale,
                                 const morphray::Image& image);

}  // namespace mray::app
