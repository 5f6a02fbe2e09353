// The comparison of two OpenEXR files.
#pragma once

#include "app/base/exit_code.h"
#include "app/base/options.h"
#include "app/terminal/messages.h"

namespace mray::app {

/// `morphray diff` of two OpenEXR files. Throws Error.
ExitCode run_exr_diff(const Options& options, const Messages& messages);

}  // namespace mray::app
