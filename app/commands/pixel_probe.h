// Traces one pixel and describes how its result comes about.
#pragma once

#include <cstdint>
#include <string>

#include "app/base/options.h"
#include "app/report/probe_report.h"
#include "app/terminal/messages.h"

namespace mray::app {

/// Traces the image of options.frame and describes options.pixel. Throws Error(kBadArgument) for a
/// pixel outside the image.
ProbeReport probe_pixel(const ProbeOptions& options, const Messages& messages);

/// "triangle 46629, 9.28 away, red; all agree": the hit in the image, its distance in world space
/// and the colour, and whether the ray alone and brute force find the same bits; without a newline.
std::string probe_sentence(const ProbeReport& report);

/// "red", "dark green", "light grey": a colour of RGBA bytes, red lowest, in words.
std::string colour_name(std::uint32_t colour);

}  // namespace mray::app
