// The commands of the program with their options.
#pragma once

#include <CLI/App.hpp>
#include <span>
#include <string>

#include "app/cli/command_line.h"

namespace mray::app {

/// Adds all commands. The one that is given sets `parsed.options` at the end of the parse. `app`
/// and `parsed` must outlive it.
void add_commands(CLI::App& app, ParsedCommandLine& parsed, std::span<const std::string> arguments);

}  // namespace mray::app
