// From argv to Options. The only place that knows CLI11.
#pragma once

#include <optional>
#include <span>
#include <string>

#include "app/cli/options.h"

namespace morphray::app {

struct ParsedCommandLine {
    /// Nothing when help or the version was asked for.
    std::optional<Options> options;
    /// That text, for stdout.
    std::string text;
};

/// `arguments` without the program's name. Throws Error(kBadArgument), or kLimit for a size beyond
/// all limits.
ParsedCommandLine parse_command_line(std::span<const std::string> arguments);

}  // namespace morphray::app
