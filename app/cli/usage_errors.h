// Messages about command lines that cannot be parsed.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace mray::app {

/// A command line that the parser rejected.
struct FailedParse {
    std::span<const std::string> arguments;
    std::vector<std::string> commands;
    /// The recognised command, or empty.
    std::string command;
    /// Long names without dashes: of the program itself, and of the command (or the program again).
    std::vector<std::string> program_options;
    std::vector<std::string> options;
    /// The option that was given most often, and how often.
    std::string repeated;
    std::size_t times = 0;
    /// Arguments that were not recognised.
    std::vector<std::string> extras;
    std::string message;
};

/// Throws Error(kBadArgument) with one line: the problem and the remedy.
[[noreturn]] void explain(const FailedParse& parse);

/// Throws Error(kBadArgument) about an unknown command.
[[noreturn]] void reject_command(const std::string& given, std::vector<std::string> commands);

}  // namespace mray::app
