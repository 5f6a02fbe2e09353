// The commands that read questions from a file and write answers to a file.
#pragma once

#include "app/base/options.h"
#include "app/cli/options/command_spec.h"

namespace mray::app {

// As command_specs().
CommandSpec define_trace(Options& options);
CommandSpec define_query(Options& options);

}  // namespace mray::app
