// The help of the program and of its commands.
#pragma once

#include <CLI/CLI.hpp>
#include <span>
#include <string>
#include <string_view>

namespace mray::app {

/// Columns of the help: those of the narrowest usual terminal.
inline constexpr std::size_t kHelpColumns = 80;

/// A command line that works, and what it does.
struct Example {
    const char* does;
    const char* line;
};

/// Sets the examples that the help of the command ends with. Lines of more than kHelpColumns - 4
/// characters would be too long; the test `Help.FitsIntoEightyColumns` finds them.
void set_examples(CLI::App& command, std::span<const Example> examples);

/// `text` in lines of at most `columns` characters, each line but the first after `indent` blanks.
/// A word that is longer has a line of its own. Lines of `text` stay apart.
std::string wrapped(std::string_view text, std::size_t indent, std::size_t columns = kHelpColumns);

/// Writes each help text of the program, with these parts, of which empty ones are left out:
///
///   what it does
///   Usage: morphray COMMAND SCENE [OPTIONS]
///   Arguments:, Options:, Commands:   an entry a line, its text from column 31 on
///   Examples:                              what each does, and below it the line
///   notes                                  paragraphs: what SCENE is, exit codes
///
/// `cmake/manual/parse_help.awk` reads this form for man pages and completions.
class HelpFormatter : public CLI::FormatterBase {
public:
    std::string make_help(const CLI::App* app, std::string name,
                          CLI::AppFormatMode mode) const override;
};

}  // namespace mray::app
