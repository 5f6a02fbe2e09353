// Adds options to one command of the program.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <span>
#include <string>
#include <type_traits>

#include "app/base/choices.h"
#include "app/base/options.h"

namespace mray::app {

/// Options of one command, each of which writes into one Options. The command, the Options and the
/// targets outlive the parse.
class OptionAdder {
public:
    /// Receives the option's name and its value, which is not empty; throws Error(kBadArgument).
    using Setter = std::function<void(const std::string& option, const std::string& value)>;

    OptionAdder(CLI::App& command, Options& options) : command_(command), options_(options) {}

    CLI::App& command() const { return command_; }
    Options& options() const { return options_; }

    CLI::Option* add(const char* name, const char* type, const std::string& help, Setter set) const;
    CLI::Option* add_text(const char* name, const char* type, const std::string& help,
                          std::string& target) const;
    void add_flag(const char* name, const char* help, bool& target) const;
    /// An option that decides which image is traced: Options::view_arguments keeps it, too.
    void add_view(const char* name, const char* type, const char* help, Setter set) const;

    /// An option with one of a few values.
    template <class T>
    void add_choice(const char* name, const std::string& help,
                    std::type_identity_t<std::span<const Choice<T>>> choices, T& target) const {
        add(name, "", help,
            [choices, &target](const std::string& option, const std::string& value) {
                target = parse_choice<T>(option, value, choices);
            })
            ->type_name(names_of<T>(choices));
    }

private:
    CLI::App& command_;
    Options& options_;
};

}  // namespace mray::app
