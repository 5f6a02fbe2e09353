// The answer of `probe` in a sentence.
#pragma once

#include <cstdint>
#include <string>

#include "app/report/probe_report.h"

namespace mray::app {

/// "triangle 46629, 9.28 away, red; all agree": the hit in the image, its distance in world space
/// and the colour, and whether the ray alone and brute force find the same bits; without a newline.
std::string probe_sentence(const ProbeReport& report);

/// "red", "dark green", "light grey": a colour of RGBA bytes, red lowest, in words.
std::string colour_name(std::uint32_t colour);

}  // namespace mray::app
