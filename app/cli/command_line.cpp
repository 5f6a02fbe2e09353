#include "app/cli/command_line.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>
#include <sstream>
#include <vector>

#include "app/cli/conflicts.h"
#include "app/cli/help/help_formatter.h"
#include "app/cli/options/command_options.h"
#include "app/cli/unused_options.h"
#include "app/cli/usage_errors.h"
#include "common/base/errors.h"
#include "common/version.h"

namespace mray::app {
namespace {

/// The commands with their options, each of which writes into one Options.
class CommandLine {
public:
    CommandLine() : app_("Ray tracer for triangle scenes that deform.", "morphray") {
        app_.require_subcommand(1);
        app_.formatter(std::make_shared<HelpFormatter>());
        app_.set_help_flag("-h,--help", "print this help");
        app_.set_version_flag("--version", fmt::format("morphray {}", kVersionDetail),
                              "print the version");
        add_commands(app_, options_);
    }

    ParsedCommandLine parse(std::span<const std::string> arguments);

private:
    std::string help(std::span<const std::string> topics) const;
    std::vector<std::string> given_options() const;
    FailedParse describe(const CLI::ParseError& error,
                         std::span<const std::string> arguments) const;

    Options options_;
    CLI::App app_;
};

std::vector<std::string> command_names(const CLI::App& app) {
    std::vector<std::string> names;
    for (const CLI::App* sub : app.get_subcommands({})) names.push_back(sub->get_name());
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
        return app_.help();
    }
    for (const CLI::App* sub : app_.get_subcommands({})) {
        if (sub->get_name() == topics[0]) return sub->help(app_.get_name());
    }
    reject_command(topics[0], command_names(app_));
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

FailedParse CommandLine::describe(const CLI::ParseError& error,
                                  std::span<const std::string> arguments) const {
    const std::vector<const CLI::App*> chosen =
        app_.get_subcommands([](const CLI::App* sub) { return sub->parsed(); });
    const CLI::App& command = chosen.empty() ? app_ : *chosen.front();
    FailedParse parse;
    parse.arguments = arguments;
    parse.commands = command_names(app_);
    if (!chosen.empty()) parse.command = command.get_name();
    parse.program_options = option_names(app_);
    parse.options = option_names(command);
    for (const CLI::Option* option : command.get_options()) {
        if (option->count() <= parse.times) continue;
        parse.repeated = option->get_name();
        parse.times = option->count();
    }
    parse.extras = app_.remaining(true);
    parse.message = error.what();
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
        explain(describe(error, arguments));
    }
    options_.given = given_options();
    options_.arguments.assign(arguments.begin(), arguments.end());
    check_conflicts(options_);
    check_unused_options(options_);
    return {options_, {}};
}

}  // namespace

ParsedCommandLine parse_command_line(std::span<const std::string> arguments) {
    return CommandLine().parse(arguments);
}

}  // namespace mray::app
