// Which frames to render.
#pragma once

#include <string>
#include <vector>

namespace morphray {

inline constexpr std::size_t kMaxFrames = 1'000'000;

/// `A`, `A..B` or `A..B:STEP` with decimal numbers, A <= B and STEP > 0 (1 where it is not given),
/// as the frames A + i * STEP up to B. B itself is in when it is hit but for rounding (1e-9 of a
/// step), and then as exactly B. Throws Error(kBadArgument) for anything else and for more than
/// 10^6 frames.
std::vector<double> parse_frame_range(const std::string& text);

}  // namespace morphray
