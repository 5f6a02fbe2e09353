// The help of the program and of its commands.
#pragma once

#include <string>
#include <string_view>

#include "app/cli/options/command_spec.h"

namespace mray::app {

/// Columns of the help: those of the narrowest usual terminal.
inline constexpr std::size_t kHelpColumns = 80;

/// `text` in lines of at most `columns` characters, each line but the first after `indent` blanks.
/// A word that is longer has a line of its own. Lines of `text` stay apart.
std::string wrapped(std::string_view text, std::size_t indent, std::size_t columns = kHelpColumns);

/// Returns the help of the program or of a command, with these parts, of which empty ones are left
/// out:
///
///   what it does
///   Usage: morphray COMMAND SCENE [OPTIONS]
///   Arguments:, Options:, Commands:   an entry a line, its text from column 31 on
///   Examples:                              what each does, and below it the lines
///   notes                                  paragraphs: what SCENE is, exit codes
std::string help_of(const ProgramSpec& program);
std::string help_of(const ProgramSpec& program, const CommandSpec& command);

}  // namespace mray::app
