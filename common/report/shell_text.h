// Arguments as text for a shell.
#pragma once

#include <span>
#include <string>

namespace mray {

/// The argument as it is, or in single quotes if the shell would interpret it.
std::string shell_quoted(const std::string& argument);

/// All arguments, quoted where necessary, with blanks between, for a person to read and to paste
/// into bash or zsh: an argument with control characters or bytes that are not UTF-8 is $'...' with
/// these bytes as \xNN.
std::string shell_line(std::span<const std::string> arguments);

}  // namespace mray
