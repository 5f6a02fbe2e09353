// A video of images.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "app/commands/merge/merge_parts.h"

namespace mray::app {

/// Throws Error: kUnavailable without ffmpeg on the PATH, kBadArgument for a name without an end
/// that says which kind of video it is, kOutput if the file cannot be written.
void check_video(const std::string& file);

/// Writes the images, of which there is one at least, as a video by ffmpeg: whole, or not at all.
/// Throws Error(kOutput) if ffmpeg fails.
void write_video(const std::string& file, std::uint32_t rate,
                 const std::vector<MergedFrame>& frames);

}  // namespace mray::app
