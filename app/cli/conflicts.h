// Options that are fine alone and not together.
#pragma once

#include "app/cli/options.h"

namespace morphray::app {

/// Throws Error(kBadArgument) that names both.
void check_conflicts(const Options& options);

}  // namespace morphray::app
