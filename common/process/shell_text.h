// Arguments as a command line that can be pasted into a shell.
#pragma once

#include <span>
#include <string>

namespace morphray {

/// The argument as it is, or in single quotes where a shell would take it apart.
std::string shell_quoted(const std::string& argument);

/// All of them, with blanks between.
std::string shell_line(std::span<const std::string> arguments);

}  // namespace morphray
