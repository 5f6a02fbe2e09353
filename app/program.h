// The whole program behind main().
#pragma once

#include <exception>
#include <span>
#include <string>

#include "app/cli/exit_code.h"
#include "app/terminal/messages.h"

namespace morphray::app {

/// One line on stderr about what ended a command, and the exit code that belongs to it.
ExitCode explain_failure(std::exception_ptr failure, const Messages& messages);

/// Parses, runs the command, and turns whatever happens into an exit code and one line on stderr.
int run_program(std::span<const std::string> arguments);

}  // namespace morphray::app
