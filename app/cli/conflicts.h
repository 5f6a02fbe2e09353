// Options that exclude each other.
#pragma once

#include "app/base/options.h"

namespace mray::app {

/// Throws Error(kBadArgument) that names both options.
void check_conflicts(const Options& options);

}  // namespace mray::app
