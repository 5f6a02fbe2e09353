// Opens the scene of a command and selects its frames.
#pragma once

#include <memory>
#include <span>

#include "app/base/messages.h"
#include "app/base/options.h"

namespace mray::app {

std::unique_ptr<Animation> open_animation(const SourceOptions& source, const Messages& messages);

inline constexpr std::size_t kMaxFrames = 1'000'000;

/// Parses `A`, `A..B` or `A..B:STEP`, with A <= B and STEP > 0 (1), or several of them with commas
/// between in increasing order, at most kMaxFrames. A frame within 1e-9 of a step of B becomes B.
/// Throws Error(kBadArgument) for any other text.
std::vector<double> parse_frame_range(const std::string& text);

enum class DefaultFrames { kAll, kFew };

/// The frames of --frames; without it up to four whole ones from the first to the last. Throws
/// Error(kBadArgument), also for --build-at outside of the animation.
std::vector<double> select_frames(const Options& options, const Animation& animation,
                                  DefaultFrames otherwise);

/// The frame of --frame, or the first. Throws Error(kBadArgument) if it or --build-at is outside.
double select_frame(const Options& options, const Animation& animation);

/// For each frame "0007", or "0007.25" where some lie between whole ones, with as many digits as
/// the last frame of the animation needs: sorted labels have the frames' order.
std::vector<std::string> frame_labels(std::span<const double> frames, const Animation& animation);

}  // namespace mray::app
