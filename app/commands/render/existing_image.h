// Images of an earlier run that need not be rendered again.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "app/base/options.h"
#include "app/commands/render/frame_tasks.h"
#include "common/image/png.h"

namespace mray::app {

/// Reads the image of a task. Its PNG file must be readable, have the pixels of its own hash, and
/// name this version, these options and this scene (a frame_hash()); the other files of the frame
/// that the options ask for must be there. Otherwise returns nothing, and in `reason` why; empty if
/// there is no file.
std::optional<Image> read_existing(const Options& options, const std::filesystem::path& folder,
                                   const FrameTask& task, std::uint64_t scene_hash,
                                   std::string& reason);

}  // namespace mray::app
