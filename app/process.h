// The beginning and the end of a process.
#pragma once

#include "app/program.h"

namespace mray::app {

/// Does what a main() has to do: runs the program with these arguments, of which the first is the
/// program's name, and ends the process with its exit code.
[[noreturn]] void run_process(int argc, char** argv, CommandRunner run_command);

}  // namespace mray::app
