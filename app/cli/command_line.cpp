#include "app/cli/command_line.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <functional>
#include <memory>
#include <sstream>
#include <variant>
#include <vector>

#include "app/cli/conflicts.h"
#include "app/cli/help/help_formatter.h"
#include "app/cli/options/command_options.h"
#include "app/cli/output_conflicts.h"
#include "app/cli/unused_options.h"
#include "app/cli/usage_errors.h"
#include "common/base/errors.h"
#include "common/report/build_record.h"
#include "common/version.h"

namespace mray::app {
namespace {

/// The first long name in "-o,--out", or the name of an argument.
std::string shown_name(const std::string& names) {
    const std::size_t begin = names.find("--");
    if (begin == std::string::npos) return names;
    return names.substr(begin, names.find(',', begin) - begin);
}

/// Adds an option to the parser of a command.
class OptionMaker {
public:
    OptionMaker(CLI::App& command, const OptionSpec& spec) : command_(command), spec_(spec) {}

    void operator()(const Setter& set) const {
        const auto set_value = [name = shown_name(spec_.names), set](const std::string& value) {
            if (value.empty()) throw Error(ErrorKind::kBadArgument, name + ": the value is empty");
            set(name, value);
        };
        describe(command_.add_option_function<std::string>(spec_.names, set_value, spec_.help));
    }
    void operator()(bool* target) const {
        command_.add_flag(spec_.names, *target, spec_.help)
            ->multi_option_policy(CLI::MultiOptionPolicy::Throw);
    }
    void operator()(const ValueList& list) const {
        CLI::Option* option = command_.add_option(spec_.names, *list.values, spec_.help);
        describe(option);
        if (list.count > 0) option->expected(list.count);
    }

private:
    void describe(CLI::Option* option) const {
        option->type_name(spec_.value_name)->required(spec_.required);
    }

    CLI::App& command_;
    const OptionSpec& spec_;
};

void add_command(CLI::App& program, const CommandSpec& spec, Options& options) {
    CLI::App& command = *program.add_subcommand(spec.name, spec.help);
    for (const OptionSpec& option : spec.options)
        std::visit(OptionMaker(command, option), option.target);
    if (spec.set_defaults)
        command.preparse_callback([set = spec.set_defaults](std::size_t) { set(); });
    command.callback([&options, command = spec.command] { options.command = command; });
}

/// Gives CLI11 the help that it prints for --help.
class HelpFormatter : public CLI::FormatterBase {
public:
    explicit HelpFormatter(const ProgramSpec& spec) : spec_(spec) {}

    std::string make_help(const CLI::App* app, std::string, CLI::AppFormatMode) const override {
        for (const CommandSpec& command : spec_.commands)
            if (app->get_parent() && app->get_name() == command.name)
                return help_of(spec_, command);
        return help_of(spec_);
    }

private:
    const ProgramSpec& spec_;
};

ProgramSpec program_spec(Options& options) {
    return {"morphray",
            "Ray tracer for triangle scenes that deform.",
            {"-h,--help", "print this help"},
            {"-v,--version", "print the version"},
            {"--verbose", "with --version: also compiler, CMake and packages of the build"},
            command_specs(options)};
}

std::string version_text(bool verbose) {
    std::string text = fmt::format("morphray {}", kVersionDetail);
    if (verbose) text += '\n' + build_record_text();
    return text;
}

/// The commands with their options, each of which writes into one Options.
class CommandLine {
public:
    CommandLine() : spec_(program_spec(options_)), app_(spec_.help, spec_.name) {
        app_.require_subcommand(1);
        app_.formatter(std::make_shared<HelpFormatter>(spec_));
        app_.set_help_flag(spec_.help_flag.names, spec_.help_flag.help);
        verbose_ = app_.add_flag(spec_.verbose_flag.names)->description(spec_.verbose_flag.help);
        const std::function<std::string()> version = [this] {
            return version_text(verbose_->count() > 0);
        };
        app_.set_version_flag(spec_.version_flag.names, version, spec_.version_flag.help);
        for (const CommandSpec& command : spec_.commands) add_command(app_, command, options_);
    }

    ParsedCommandLine parse(std::span<const std::string> arguments);

private:
    std::string help(std::span<const std::string> topics) const;
    std::vector<std::string> given_options() const;
    void refuse_verbose() const;
    FailedParse describe(const CLI::ParseError& error,
                         std::span<const std::string> arguments) const;

    Options options_;
    ProgramSpec spec_;
    CLI::App app_;
    const CLI::Option* verbose_ = nullptr;
};

std::vector<std::string> command_names(const ProgramSpec& program) {
    std::vector<std::string> names;
    for (const CommandSpec& command : program.commands) names.push_back(command.name);
    return names;
}

std::vector<std::string> option_names(const CLI::App& app) {
    std::vector<std::string> names;
    for (const CLI::Option* option : app.get_options()) {
        names.insert(names.end(), option->get_lnames().begin(), option->get_lnames().end());
    }
    return names;
}

// Help of the program, or of the command that follows `help`.
std::string CommandLine::help(std::span<const std::string> topics) const {
    if (topics.size() > 1) {
        throw Error(ErrorKind::kBadArgument,
                    fmt::format("unexpected argument '{}'; see `morphray help`", topics[1]));
    }
    if (topics.empty() || topics[0] == "help" || topics[0] == "--help" || topics[0] == "-h") {
        return help_of(spec_);
    }
    for (const CommandSpec& command : spec_.commands)
        if (command.name == topics[0]) return help_of(spec_, command);
    reject_command(topics[0], command_names(spec_));
}

std::vector<std::string> CommandLine::given_options() const {
    std::vector<std::string> given;
    for (const CLI::App* command : app_.get_subcommands()) {
        for (const CLI::Option* option : command->get_options()) {
            if (option->count() > 0 && !option->get_lnames().empty())
                given.push_back("--" + option->get_lnames().front());
        }
    }
    return given;
}

/// Throws Error(kBadArgument) if --verbose was given to the program, without --version.
void CommandLine::refuse_verbose() const {
    if (verbose_->count() == 0) return;
    throw Error(ErrorKind::kBadArgument,
                "--verbose: before a command it needs --version; give it after the command");
}

FailedParse CommandLine::describe(const CLI::ParseError& error,
                                  std::span<const std::string> arguments) const {
    const std::vector<const CLI::App*> chosen =
        app_.get_subcommands([](const CLI::App* sub) { return sub->parsed(); });
    const CLI::App& command = chosen.empty() ? app_ : *chosen.front();
    FailedParse parse;
    parse.arguments = arguments;
    parse.commands = command_names(spec_);
    if (!chosen.empty()) parse.command = command.get_name();
    parse.program_options = option_names(app_);
    // Alone it is no option of the program.
    std::erase(parse.program_options, "verbose");
    parse.options = option_names(command);
    parse.extras = app_.remaining(true);
    for (const CLI::Option* option : command.get_options()) {
        // Arguments such as scenes have several values.
        const auto most = static_cast<std::size_t>(option->get_items_expected_max());
        if (most > 1 && option->count() > most) parse.extras.push_back(option->results()[most]);
        if (most > 1 || option->count() <= parse.times) continue;
        parse.repeated = option->get_name();
        parse.times = option->count();
    }
    parse.message = error.what();
    if (error.get_name() != "RequiredError") return parse;
    for (const CLI::Option* option : command.get_options()) {
        if (!option->get_positional() || !option->get_required() || option->count() > 0) continue;
        parse.message = option->get_type_name() + " is required";
    }
    return parse;
}

ParsedCommandLine CommandLine::parse(std::span<const std::string> arguments) {
    if (!arguments.empty() && arguments.front() == "help") {
        return {std::nullopt, help(arguments.subspan(1))};
    }
    try {
        app_.parse(std::vector<std::string>(arguments.rbegin(), arguments.rend()));
    } catch (const CLI::Success& success) {
        std::ostringstream out;
        app_.exit(success, out, out);
        return {std::nullopt, out.str()};
    } catch (const CLI::ParseError& error) {
        refuse_verbose();
        explain(describe(error, arguments));
    }
    refuse_verbose();
    options_.given = given_options();
    options_.arguments.assign(arguments.begin(), arguments.end());
    check_conflicts(options_);
    check_output_conflicts(options_);
    check_unused_options(options_);
    return {options_, {}};
}

}  // namespace

ParsedCommandLine parse_command_line(std::span<const std::string> arguments) {
    return CommandLine().parse(arguments);
}

}  // namespace mray::app
