// The scene of a command, and the frames of it that the command line asks for.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "app/cli/options.h"
#include "app/terminal/messages.h"
#include "common/scene/scene_frames.h"

namespace morphray::app {

/// Opens options.scene after an estimate of what it takes; its warnings go to `messages`.
SceneFrames open_frames(const Options& options, const Messages& messages);

enum class DefaultFrames { kAll, kFew, kFirst };

/// The frames of --frames, or else: every whole frame; at most about four, with the first, the
/// middle and the last; the first. Never empty. Throws Error(kBadArgument).
std::vector<double> select_frames(const Options& options, const Clip& clip,
                                  DefaultFrames otherwise);

/// Warns of files of the clip that cannot be used, unless the frames (or --build-at) need one of
/// them: then that error tells.
void warn_of_damage(const Options& options, const Clip& clip, std::span<const double> frames,
                    const Messages& messages);

/// Throws Error(kBadArgument) for a frame outside the clip.
void require_in_clip(const char* option, double frame, const Clip& clip);

/// "0007", or "0007.25" between whole frames: sorts by name as by number.
std::string frame_label(double frame);

}  // namespace morphray::app
