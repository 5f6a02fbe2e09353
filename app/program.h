// Runs the program.
#pragma once

#include "app/base/options.h"
#include "app/terminal/failure.h"
#include "app/terminal/messages.h"

namespace mray::app {

/// Runs the command of the options. Returns kOk, kCheckFailed, or kPartial after a message. Throws
/// Error.
using CommandRunner = ExitCode (*)(const CommandOptions& options, const Messages& messages);

/// Does what a main() has to do: parses the arguments, of which the first is the program's name,
/// runs the command, and ends the process with its exit code; writes a line to stderr on failure.
[[noreturn]] void run_process(int argc, char** argv, CommandRunner run_command);

}  // namespace mray::app
