// What to say to a command line that cannot be followed.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace morphray::app {

/// What the parser made of it.
struct FailedParse {
    std::span<const std::string> arguments;
    std::vector<std::string> commands;
    /// The command that was recognised, or empty.
    std::string command;
    /// Long names without dashes: of the program itself, and of the command (or the program again).
    std::vector<std::string> program_options;
    std::vector<std::string> options;
    /// The option that was given most often, and how often.
    std::string repeated;
    std::size_t times = 0;
    /// What nothing was made of.
    std::vector<std::string> extras;
    std::string message;
};

/// Throws Error(kBadArgument) with one line that says what is wrong and what to do.
[[noreturn]] void explain(const FailedParse& parse);

/// Likewise for a command that there is not.
[[noreturn]] void reject_command(const std::string& given, std::vector<std::string> commands);

}  // namespace morphray::app
