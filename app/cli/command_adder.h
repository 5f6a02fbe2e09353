// Adding commands to the command line, each with a structure of options of its own.
#pragma once

#include <CLI/App.hpp>
#include <memory>
#include <span>
#include <string>

#include "app/cli/command_line.h"
#include "app/cli/option_groups.h"
#include "common/base/errors.h"

namespace mray::app {

[[noreturn]] inline void refuse(const std::string& message) {
    throw Error(ErrorKind::kBadArgument, message);
}

/// Adds commands, each of which fills its own structure.
class CommandAdder {
public:
    CommandAdder(CLI::App& app, ParsedCommandLine& parsed) : app_(app), parsed_(parsed) {}

    /// Adds a command whose options `define(command, options)` adds; it may return what completes
    /// the options after the parse.
    template <class Options, class Define>
    void add(const char* name, const char* help, const char* examples, Define define) {
        CLI::App& command = *app_.add_subcommand(name, help);
        command.footer(std::string("Examples:\n") + examples);
        const auto options = std::make_shared<Options>();
        const auto complete = define(command, *options);
        command.callback([&parsed = parsed_, options, complete] {
            complete();
            parsed.options = *options;
        });
    }

    /// -q of a command.
    void add_quiet(CLI::App& command) const {
        add_flag(command, "-q,--quiet", "neither table nor progress", parsed_.quiet);
    }
    /// -v of a command.
    void add_verbose(CLI::App& command) const {
        add_flag(command, "-v,--verbose", "say what is used and decided", parsed_.verbose);
    }

private:
    CLI::App& app_;
    ParsedCommandLine& parsed_;
};

/// Completes the options of a command that has nothing to complete.
inline constexpr auto kNothing = [] {};

/// Adds all commands. The one that is given sets `parsed.options` at the end of the parse. `app`
/// and `parsed` must outlive it.
void add_commands(CLI::App& app, ParsedCommandLine& parsed, std::span<const std::string> arguments);

// The commands that trace images (app/cli/image_commands.cpp).
void add_render(CommandAdder& adder);
void add_view(CommandAdder& adder);
void add_crosscheck(CommandAdder& adder, std::span<const std::string> arguments);
void add_probe(CommandAdder& adder);
void add_profile(CommandAdder& adder);

}  // namespace mray::app
