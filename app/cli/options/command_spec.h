// The command line of the program as data. app/cli/command_line.cpp makes a parser of it, and
// app/cli/help/ the help.
#pragma once

#include <functional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "app/base/options.h"

namespace mray::app {

/// Receives the option's name and its value, which is not empty; throws Error(kBadArgument).
using Setter = std::function<void(const std::string& option, const std::string& value)>;

/// Receives several values.
struct ValueList {
    std::vector<std::string>* values;
    /// How many there are; 0: one or more.
    int count = 0;
};

/// An option, or an argument without a name.
struct OptionSpec {
    /// "-o,--out", "--frames,--frame"; without dashes, such as "scene", if it is an argument.
    std::string names;
    /// The value in the help, such as "DIR"; empty for a flag.
    std::string value_name;
    std::string help;
    /// Where the value goes; a flag has a bool, which outlives the parse as all targets do.
    std::variant<Setter, bool*, ValueList> target;
    bool required = false;

    bool is_argument() const { return !names.starts_with('-'); }
    bool is_flag() const { return std::holds_alternative<bool*>(target); }
};

/// Command lines that work one after the other in an empty folder beside share/, and what the last
/// does. They are separated by newlines.
struct Example {
    const char* does;
    const char* lines;
};

struct CommandSpec {
    std::string name;
    std::string help;
    Command command;
    /// Lines of at most kHelpColumns - 4 characters; the test `Help.FitsIntoEightyColumns` finds
    /// longer ones.
    std::span<const Example> examples;
    /// In the order of the help.
    std::vector<OptionSpec> options = {};
    /// Sets the defaults that are not those of Options, before the command's options are parsed;
    /// may be empty.
    std::function<void()> set_defaults = {};
};

/// A flag of the program.
struct ProgramFlag {
    const char* names;
    const char* help;
};

struct ProgramSpec {
    std::string name;
    std::string help;
    /// Prints the help and ends the program; also a flag of each command.
    ProgramFlag help_flag;
    /// Prints the version and ends the program.
    ProgramFlag version_flag;
    /// Belongs to version_flag; commands have one of their own.
    ProgramFlag verbose_flag;
    std::vector<CommandSpec> commands;
};

}  // namespace mray::app
