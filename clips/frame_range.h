// Frames from the text of an option.
#pragma once

#include <string>
#include <vector>

namespace mray {

inline constexpr std::size_t kMaxFrames = 1'000'000;

/// Parses `A`, `A..B` or `A..B:STEP` with decimal numbers, A <= B and STEP > 0. Without STEP it is
/// `step`; `what` is what the numbers are in messages, "frames" or "seconds". Returns
/// the frames A + i * STEP up to B; a frame within 1e-9 of a step of B becomes exactly B. Throws
/// Error(kBadArgument) for any other text and for more than 10^6 frames.
std::vector<double> parse_frame_range(const std::string& text, double step = 1,
                                      const char* what = "frames");

}  // namespace mray
