// Frames from the text of an option.
#pragma once

#include <span>
#include <string>
#include <vector>

namespace mray {

inline constexpr std::size_t kMaxFrames = 1'000'000;

/// Parses `A`, `A..B` or `A..B:STEP` with decimal numbers, A <= B and STEP > 0, or several of them
/// with commas between, such as `0..8:4,20`, each of which begins after the end of the one before.
/// Without STEP it is `step`; `what` is what the numbers are in messages, "frames" or "seconds".
/// Returns the frames A + i * STEP up to B, which increase; a frame within 1e-9 of a step of B
/// becomes exactly B. Throws Error(kBadArgument) for any other text and for more than 10^6 frames.
std::vector<double> parse_frame_range(const std::string& text, double step = 1,
                                      const char* what = "frames");

}  // namespace mray
