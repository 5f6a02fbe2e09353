// Options that are fine alone and not together.
#pragma once

#include "app/options.h"

namespace morphray::app {

/// Throws Error(kUsage) that names both.
void check_conflicts(const Options& options);

}  // namespace morphray::app
