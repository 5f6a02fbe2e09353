// Runs the program.
#pragma once

#include <exception>
#include <span>
#include <string>

#include "app/base/exit_code.h"
#include "app/base/options.h"
#include "app/terminal/messages.h"

namespace mray::app {

/// Runs the command of the options. Returns kOk, kCheckFailed, or kPartial after a message. Throws
/// Error.
using CommandRunner = ExitCode (*)(const Options& options, const Messages& messages);

/// Writes one line about the failure to stderr and returns its exit code.
ExitCode explain_failure(const std::exception_ptr& failure, const Messages& messages);

/// Parses the arguments and runs the command. Returns the exit code; writes one line to stderr on
/// failure.
int run_program(std::span<const std::string> arguments, CommandRunner run_command);

}  // namespace mray::app
