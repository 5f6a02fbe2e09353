// From argv to the options of a command.
#pragma once

#include "app/base/options.h"

namespace mray::app {

struct ParsedCommandLine {
    /// Nothing if help or the version was asked for.
    std::optional<Options> options;
    std::string text;
};

/// Throws Error(kBadArgument) with one line, or Error(kLimit) for too large a number.
ParsedCommandLine parse_command_line(std::span<const std::string> arguments);

}  // namespace mray::app
