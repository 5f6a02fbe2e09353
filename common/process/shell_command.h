// Running a command of the shell.
#pragma once

#include <string>

namespace morphray {

struct ShellResult {
    /// The command's exit status; -1 if it did not start or was ended by a signal.
    int status = -1;
    /// What it wrote to its standard output.
    std::string text;
};

/// Waits for the command. Never throws but for lack of memory.
ShellResult run_shell(const std::string& command);

}  // namespace morphray
