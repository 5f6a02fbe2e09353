// The whole program behind main().
#pragma once

#include <span>
#include <string>

namespace morphray::app {

/// Parses, runs the command, and turns whatever happens into an exit code and one line on stderr.
int run_program(std::span<const std::string> arguments);

}  // namespace morphray::app
