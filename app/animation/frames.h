// Opens the scene of a command and selects its frames.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "app/base/options.h"
#include "app/terminal/messages.h"
#include "scenes/scene_frames.h"

namespace mray::app {

/// Opens the scene; warnings go to `messages`. Throws Error.
std::unique_ptr<Animation> open_animation(const SourceOptions& source, const Messages& messages);

inline constexpr std::size_t kMaxFrames = 1'000'000;

/// Parses `A`, `A..B` or `A..B:STEP` with decimal numbers, A <= B and STEP > 0, or several of them
/// with commas between, such as `0..8:4,20`, each of which begins after the end of the one before.
/// Without STEP it is 1. Returns the frames A + i * STEP up to B, which increase; a frame within
/// 1e-9 of a step of B becomes exactly B. Throws Error(kBadArgument) for any other text and for
/// more than 10^6 frames.
std::vector<double> parse_frame_range(const std::string& text);

enum class DefaultFrames { kAll, kFew };

/// The frames of --frames, every whole one for "all"; without it every whole frame, or up to four
/// frames from the first to the last. Never empty. Throws Error(kBadArgument), also for --build-at
/// outside of the animation.
std::vector<double> select_frames(const std::string& frames, const std::optional<double>& build_at,
                                  const Animation& animation, DefaultFrames otherwise);

/// The frame of --frame; without it the first. Throws Error(kBadArgument) for one, or --build-at,
/// outside of the animation.
double select_frame(const std::optional<double>& frame, const std::optional<double>& build_at,
                    const Animation& animation);

/// How many digits the numbers of frames have in the names of files.
struct FrameDigits {
    std::size_t whole = 4;
    std::size_t fraction = 0;
};
/// As many as the last frame of the animation and the fractions of these frames need.
FrameDigits digits_of(std::span<const double> frames, const Animation& animation);
/// "0007", or "0007.00" and "0007.25" where some frames lie between whole ones: names of one
/// animation sort in the order of the frames.
std::string frame_label(double frame, const FrameDigits& digits);

}  // namespace mray::app
