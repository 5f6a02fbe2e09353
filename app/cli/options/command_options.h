// The commands of the program with their options.
#pragma once

#include <vector>

#include "app/base/options.h"
#include "app/cli/options/command_spec.h"

namespace mray::app {

/// Returns every command, in the order of the help. Their options write into `options`, which
/// outlives them.
std::vector<CommandSpec> command_specs(Options& options);

}  // namespace mray::app
