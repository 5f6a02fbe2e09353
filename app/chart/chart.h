// Draws charts of speed against accuracy.
#pragma once

#include "app/base/options.h"
#include "app/terminal/failure.h"
#include "app/terminal/messages.h"

namespace mray::app {

/// Writes the charts of all scenes into the folder --out, as a whole or not at all. Returns kOk.
/// Throws Error.
ExitCode draw_charts(const ChartOptions& options, const Messages& messages);

}  // namespace mray::app
