// morphray profile --backend ray-query: a driver's own rays and ours on the same device.
#pragma once

#include "app/base/exit_code.h"
#include "app/base/options.h"
#include "app/terminal/messages.h"

namespace mray::app {

/// Measures builds, updates, rebuilds and rays of the driver, and the same of our backend with the
/// same rays, by the device's clock. Returns kOk. Throws Error.
ExitCode profile_driver(const Options& options, const Messages& messages);

}  // namespace mray::app
