// The commands of the program with their options.
#pragma once

#include <CLI/CLI.hpp>

#include "app/base/options.h"

namespace mray::app {

/// Adds every command to `program`. A parse writes the command and its options into `options`,
/// which outlives it.
void add_commands(CLI::App& program, Options& options);

}  // namespace mray::app
