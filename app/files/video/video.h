// A video of images.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "app/terminal/interrupt.h"

namespace mray::app {

/// Throws Error: kUnavailable without ffmpeg on the PATH, kBadArgument for a name without an end
/// that says which kind of video it is, kOutput if the file cannot be written.
void check_video(const std::string& file);

/// Whether there is an ffmpeg on the PATH.
bool can_write_videos();

/// Writes PNG files, of which there is one at least, as a video of `rate` images a second by
/// ffmpeg: whole, or not at all. Throws Error: kOutput if ffmpeg fails, kBadInput for a file that
/// cannot be read, kCancelled soon after `cancel` becomes true.
void write_video(const std::string& file, std::uint32_t rate,
                 const std::vector<std::filesystem::path>& images,
                 const std::atomic<bool>& cancel = interrupt_flag());

}  // namespace mray::app
