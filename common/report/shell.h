// Shell commands, and arguments as text for a shell.
#pragma once

#include <span>
#include <string>

namespace mray {

struct ShellResult {
    /// The command's exit status; -1 if it did not start or was ended by a signal.
    int status = -1;
    /// Its standard output.
    std::string text;
};

/// Runs the command and waits for it.
ShellResult run_shell(const std::string& command);

/// The argument as it is, or in single quotes if the shell would interpret it.
std::string shell_quoted(const std::string& argument);

/// All arguments, quoted where necessary, with blanks between.
std::string shell_line(std::span<const std::string> arguments);

}  // namespace mray
