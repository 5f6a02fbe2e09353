// Runs shell commands.
#pragma once

#include <string>

namespace mray {

struct ShellResult {
    /// The command's exit status; -1 if it did not start or was ended by a signal.
    int status = -1;
    /// Its standard output.
    std::string text;
};

/// Runs the command and waits for it. Throws only std::bad_alloc.
ShellResult run_shell(const std::string& command);

}  // namespace mray
