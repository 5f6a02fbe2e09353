// Traces one pixel and describes how its result comes about.
#pragma once

#include "app/base/options.h"
#include "app/report/probe_report.h"
#include "app/terminal/messages.h"

namespace mray::app {

/// Traces the image of options.frame and describes options.pixel. Throws Error(kBadArgument) for a
/// pixel outside the image.
ProbeReport probe_pixel(const Options& options, const Messages& messages);

}  // namespace mray::app
