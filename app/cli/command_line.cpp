#include "app/cli/command_line.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>
#include <vector>

#include "app/cli/option_groups.h"
#include "common/base/errors.h"
#include "common/text/text.h"
#include "common/version.h"

namespace mray::app {
namespace {

constexpr std::size_t kTextColumn = 30;

constexpr const char* kFooter =
    "`morphray help COMMAND` lists the everyday options of a command, `morphray COMMAND "
    "--help-all` all of them; `morphray info` lists the built-in scenes.\n\n"
    "Exit codes: 0 ok, 1 a check failed, 2 usage, 3 bad input, 4 backend or device unavailable, "
    "5 output cannot be written, 6 out of memory or over a limit, 7 device lost, 8 partial result "
    "kept, 70 internal error, 129 ended by SIGHUP, 130 ended by SIGINT (Ctrl-C), 143 ended by "
    "SIGTERM.";

/// CLI11's help in 80 columns.
class HelpFormatter : public CLI::Formatter {
public:
    HelpFormatter() {
        column_width(kTextColumn);
        label("Positionals", "Arguments");
        label("SUBCOMMAND", "COMMAND");
    }

    /// --help has the everyday options alone.
    std::string make_help(const CLI::App* app, std::string name,
                          CLI::AppFormatMode mode) const override {
        std::string groups;
        for (const std::string& group : app->get_groups()) {
            if (mode == CLI::AppFormatMode::Normal && group != kEveryday) continue;
            groups += make_group(group, false, app->get_options([&](const CLI::Option* option) {
                return option->nonpositional() && option->get_group() == group;
            }));
        }
        return make_description(app) + make_usage(app, name) + make_positionals(app) + groups +
               make_subcommands(app, mode) + '\n' + make_footer(app);
    }
    std::string make_option_opts(const CLI::Option* option) const override {
        const std::string text = option->get_option_text();
        return (text.empty() ? "" : ' ' + text) + (option->get_required() ? " REQUIRED" : "");
    }
    std::string make_option_desc(const CLI::Option* option) const override {
        return wrapped(option->get_description(), 0, kColumns - kTextColumn);
    }
    std::string make_subcommand(const CLI::App* sub) const override {
        std::ostringstream out;
        CLI::detail::format_help(out, sub->get_name(),
                                 wrapped(sub->get_description(), 0, kColumns - kTextColumn),
                                 kTextColumn);
        return out.str();
    }
};

}  // namespace

ParsedCommandLine parse_command_line(std::span<const std::string> arguments) {
    std::vector<std::string> line(arguments.begin(), arguments.end());
    // `help COMMAND` is `COMMAND --help`.
    if (!line.empty() && line.front() == "help") {
        line.erase(line.begin());
        line.emplace_back("--help");
    }
    ParsedCommandLine parsed;
    CLI::App app("Ray tracer for triangle scenes that deform.", "morphray");
    app.require_subcommand(1);
    app.formatter(std::make_shared<HelpFormatter>());
    app.set_help_flag("-h,--help", "print this help");
    app.footer(wrapped(kFooter));
    app.set_version_flag("-v,--version", fmt::format("morphray {}", kVersionDetail),
                         "print the version");
    add_commands(app, parsed, arguments);
    std::reverse(line.begin(), line.end());
    try {
        app.parse(line);
    } catch (const CLI::Success& success) {
        std::ostringstream out;
        app.exit(success, out, out);
        return {std::nullopt, out.str()};
    } catch (const CLI::ParseError& error) {
        const std::vector<CLI::App*> chosen = app.get_subcommands();
        // CLI11 misses a command before it says which word is none.
        const std::vector<std::string> extras = app.remaining(true);
        const std::string command = chosen.empty() ? "" : chosen.front()->get_name() + ' ';
        if (!extras.empty() && !extras[0].starts_with('-') && !chosen.empty() &&
            chosen.front()->get_option_no_throw("SCENE") != nullptr)
            refuse(
                fmt::format("{} is one argument too many: {}takes one SCENE; put a pattern of "
                            "files in quotes, which keep it from the shell",
                            quote(extras[0]), command));
        refuse(fmt::format("{}; see `morphray {}--help`",
                           extras.empty() ? error.what() : "unknown argument " + quote(extras[0]),
                           command));
    }
    return parsed;
}

}  // namespace mray::app
