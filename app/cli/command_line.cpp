#include "app/cli/command_line.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>
#include <sstream>
#include <vector>

#include "app/cli/command_adder.h"
#include "common/base/errors.h"
#include "common/text/text_parts.h"
#include "common/version.h"

namespace mray::app {
namespace {

constexpr std::size_t kColumns = 80;
constexpr std::size_t kTextColumn = 30;

constexpr const char* kFooter =
    "`morphray help COMMAND` or `morphray COMMAND --help` lists the options of a command; "
    "`morphray info` lists the built-in scenes.\n\n"
    "Exit codes: 0 ok, 1 a check failed, 2 usage, 3 bad input, 4 backend or device unavailable, "
    "5 output cannot be written, 6 out of memory or over a limit, 7 device lost, 8 partial result "
    "kept, 70 internal error, 129 ended by SIGHUP, 130 ended by SIGINT (Ctrl-C), 143 ended by "
    "SIGTERM.";

/// CLI11's help in 80 columns.
class HelpFormatter : public CLI::Formatter {
public:
    HelpFormatter() { column_width(kTextColumn); }

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

std::string help_hint(const CLI::App& command) {
    return fmt::format("see `morphray {}--help`",
                       command.get_parent() == nullptr ? "" : command.get_name() + ' ');
}

[[noreturn]] void refuse_unknown(const CLI::App& command, const std::string& given) {
    const bool is_option = given.starts_with('-');
    std::vector<std::string> names;
    if (is_option) {
        for (const CLI::Option* option : command.get_options())
            for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    } else if (command.get_parent() == nullptr) {
        for (const CLI::App* sub : command.get_subcommands({})) names.push_back(sub->get_name());
    }
    const std::string similar = similar_name(given.substr(0, given.find('=')), names);
    throw Error(ErrorKind::kBadArgument,
                fmt::format("unknown {} '{}'; {}",
                            is_option       ? "option"
                            : names.empty() ? "argument"
                                            : "command",
                            given,
                            similar.empty() ? help_hint(command)
                                            : fmt::format("did you mean {}?", similar)));
}

[[noreturn]] void refuse_line(const CLI::App& app, const CLI::ParseError& error) {
    const std::vector<const CLI::App*> chosen =
        app.get_subcommands([](const CLI::App* sub) { return sub->parsed(); });
    const CLI::App& command = chosen.empty() ? app : *chosen.front();
    std::vector<std::string> extras = app.remaining(true);
    if (!extras.empty()) {
        // The value of an unknown option may have been taken for something else.
        const auto option = std::ranges::find_if(
            extras, [](const std::string& extra) { return extra.starts_with('-'); });
        refuse_unknown(command, option == extras.end() ? extras.front() : *option);
    }
    throw Error(ErrorKind::kBadArgument, fmt::format("{}; {}", error.what(), help_hint(command)));
}

std::string version_text(bool verbose) {
    std::string text = fmt::format("morphray {}", kVersionDetail);
    if (verbose) text += fmt::format("\ncompiled by {}", kCompiler);
    return text;
}

/// `help COMMAND` is `COMMAND --help`.
std::vector<std::string> without_help_command(std::span<const std::string> arguments) {
    if (arguments.empty() || arguments.front() != "help")
        return {arguments.begin(), arguments.end()};
    if (arguments.size() > 2)
        throw Error(ErrorKind::kBadArgument,
                    fmt::format("unexpected argument '{}'; see `morphray help`", arguments[2]));
    std::vector<std::string> line(arguments.begin() + 1, arguments.end());
    line.emplace_back("--help");
    return line;
}

/// CLI11 takes a request for help before it looks at the command.
void require_command(const CLI::App& app, const std::vector<std::string>& line) {
    if (line.empty() || line.front().starts_with('-')) return;
    const std::vector<const CLI::App*> commands = app.get_subcommands({});
    if (std::ranges::find(commands, line.front(), &CLI::App::get_name) == commands.end())
        refuse_unknown(app, line.front());
}

}  // namespace

ParsedCommandLine parse_command_line(std::span<const std::string> arguments) {
    std::vector<std::string> line = without_help_command(arguments);
    ParsedCommandLine parsed;
    CLI::App app("Ray tracer for triangle scenes that deform.", "morphray");
    app.require_subcommand(1);
    app.formatter(std::make_shared<HelpFormatter>());
    app.set_help_flag("-h,--help", "print this help");
    app.footer(wrapped(kFooter, 0, kColumns));
    const bool verbose = std::ranges::count(line, "--verbose") > 0;
    if (verbose && std::ranges::count(line, "--version") > 0) std::erase(line, "--verbose");
    app.set_version_flag("-v,--version", version_text(verbose),
                         "print the version; with --verbose also compiler and packages");
    add_commands(app, parsed, arguments);
    if (line.empty()) throw Error(ErrorKind::kBadArgument, "no command; see `morphray --help`");
    require_command(app, line);
    std::reverse(line.begin(), line.end());
    try {
        app.parse(line);
    } catch (const CLI::Success& success) {
        std::ostringstream out;
        app.exit(success, out, out);
        return {std::nullopt, out.str()};
    } catch (const CLI::ParseError& error) {
        refuse_line(app, error);
    }
    return parsed;
}

std::string wrapped(const std::string& text, std::size_t indent, std::size_t columns) {
    std::string result;
    std::istringstream paragraphs(text);
    for (std::string paragraph; std::getline(paragraphs, paragraph);) {
        if (!result.empty()) result += '\n';
        std::size_t width = 0;
        std::istringstream words(paragraph);
        for (std::string word; words >> word;) {
            if (width > 0 && width + 1 + word.size() > columns) {
                result += '\n' + std::string(indent, ' ');
                width = indent;
            } else if (width > 0) {
                result += ' ';
                ++width;
            }
            result += word;
            width += word.size();
        }
    }
    return result;
}

}  // namespace mray::app
