// Options that would have no effect on a command.
#pragma once

#include "app/base/options.h"

namespace mray::app {

/// Throws Error(kBadArgument) that names the first given option without effect with the others,
/// and why. Options whose effect depends on the scene, such as --missing, are taken.
void check_unused_options(const Options& options);

}  // namespace mray::app
