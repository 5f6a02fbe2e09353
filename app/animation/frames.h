// Opens the scene of a command and selects its frames.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "app/base/messages.h"
#include "app/base/options.h"
#include "scenes/animation.h"

namespace mray::app {

std::unique_ptr<Animation> open_animation(const SourceOptions& source, const Messages& messages);

/// Warns of mesh files whose names differ in a number alone: a shell makes them of a pattern.
void warn_of_numbered_scenes(const std::vector<std::string>& scenes, const Messages& messages);

inline constexpr std::size_t kMaxFrames = 1'000'000;

/// Parses `A`, `A..B` or `A..B:STEP`, with A <= B and STEP > 0 (1), or several of them with commas
/// between in increasing order, at most kMaxFrames. A frame within 1e-9 of a step of B becomes B.
/// Throws Error(kBadArgument) for any other text.
std::vector<double> parse_frame_range(const std::string& text);

enum class DefaultFrames { kAll, kFew };

/// The frames of --frames; without it up to four whole ones from the first to the last. Throws
/// Error(kBadArgument), also for --build-at outside of the animation.
std::vector<double> select_frames(const std::string& frames, const std::optional<double>& build_at,
                                  const Animation& animation, DefaultFrames otherwise);

/// The frame of --frame, or the first. Throws Error(kBadArgument) if it or --build-at is outside.
double select_frame(const std::optional<double>& frame, const std::optional<double>& build_at,
                    const Animation& animation);

struct FrameDigits {
    std::size_t whole = 4;
    std::size_t fraction = 0;
};
/// As many as the last frame of the animation and the fractions of these frames need.
FrameDigits digits_of(std::span<const double> frames, const Animation& animation);
/// "0007", or "0007.25" where frames lie between whole ones: sorted names have the frames' order.
std::string frame_label(double frame, const FrameDigits& digits);

}  // namespace mray::app
