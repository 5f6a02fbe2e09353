// morphray crosscheck --suspect: judges the rays that a driver traces itself.
#pragma once

#include "app/base/exit_code.h"
#include "app/base/options.h"
#include "app/terminal/messages.h"

namespace mray::app {

/// Judges the driver of options.suspect on all scenes and writes the reports. Returns kOk or, if an
/// answer is wrong, kCheckFailed. Throws Error.
ExitCode judge_driver(const Options& options, const Messages& messages);

}  // namespace mray::app
