// Adds options to one command of the program.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <type_traits>

#include "app/base/choices.h"
#include "app/base/options.h"
#include "app/cli/options/command_spec.h"

namespace mray::app {

/// Options of one command, each of which writes into one Options. The command outlives the adder;
/// the Options and the targets outlive the parse. A spec that is returned can be changed until the
/// next one is added.
class OptionAdder {
public:
    OptionAdder(CommandSpec& command, Options& options) : command_(command), options_(options) {}

    CommandSpec& command() const { return command_; }
    Options& options() const { return options_; }

    OptionSpec& add(const char* names, const std::string& value_name, const std::string& help,
                    Setter set) const;
    OptionSpec& add_text(const char* names, const char* value_name, const std::string& help,
                         std::string& target) const;
    void add_flag(const char* names, const char* help, bool& target) const;
    /// Arguments without a name, of which there has to be one or more, or `list.count`.
    void add_arguments(const char* name, const char* value_name, const char* help,
                       ValueList list) const;
    /// Returns the option with these names, which was added before.
    OptionSpec& added(std::string_view names) const;
    /// An option that decides which image is traced: Options::view_arguments keeps it, too.
    void add_view(const char* names, const char* value_name, const char* help, Setter set) const;

    /// An option with one of a few values.
    template <class T>
    void add_choice(const char* names, const std::string& help,
                    std::type_identity_t<std::span<const Choice<T>>> choices, T& target) const {
        add(names, names_of<T>(choices), help,
            [choices, &target](const std::string& option, const std::string& value) {
                target = parse_choice<T>(option, value, choices);
            });
    }

private:
    CommandSpec& command_;
    Options& options_;
};

}  // namespace mray::app
