// From argv to Options.
#pragma once

#include <optional>
#include <span>
#include <string>

#include "app/base/options.h"

namespace mray::app {

struct ParsedCommandLine {
    /// Nothing if help or the version was asked for.
    std::optional<Options> options;
    /// The help or the version, for stdout.
    std::string text;
};

/// `arguments` without the program's name. Throws Error(kBadArgument), or kLimit for a size beyond
/// all limits.
ParsedCommandLine parse_command_line(std::span<const std::string> arguments);

}  // namespace mray::app
