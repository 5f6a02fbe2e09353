#include "app/cli/help/help_formatter.h"

#include <algorithm>
#include <span>
#include <variant>

#include "scenes/mesh_files/mesh_file.h"

namespace mray::app {
namespace {

// Where the text of an entry begins. A left part that is wider has its text on the next line.
constexpr std::size_t kTextColumn = 30;

constexpr const char* kCommandNote =
    "`morphray help COMMAND` or `morphray COMMAND --help` lists the options of a command; "
    "`morphray info` lists the built-in scenes.";
constexpr const char* kExitCodes =
    "Exit codes: 0 ok, 1 a check failed, 2 usage, 3 bad input, 4 backend or device unavailable, "
    "5 output cannot be written, 6 out of memory or over a limit, 7 device lost, 8 partial result "
    "kept, 70 internal error, 129 ended by SIGHUP, 130 ended by SIGINT (Ctrl-C), 143 ended by "
    "SIGTERM.";

std::string scene_note() {
    const std::string meshes = extensions_of_meshes({});
    return "SCENE is builtin:NAME[:TRIANGLES], a mesh file (" + meshes +
           "), a folder of such files, a pattern such as frame_%04d.obj or 'frame_*.obj', or a "
           ".gltf or .glb file. `morphray info` lists the built-in scenes.";
}

/// "  left      text", the text in as many lines as it takes.
std::string entry(const std::string& left, const std::string& text) {
    std::string line = "  " + left;
    if (text.empty()) return line + '\n';
    if (line.size() + 2 > kTextColumn)
        line += '\n' + std::string(kTextColumn, ' ');
    else
        line.resize(kTextColumn, ' ');
    const std::string rest = wrapped(std::string(kTextColumn, ' ') + text, kTextColumn);
    return line + rest.substr(kTextColumn) + '\n';
}

/// "-q,--quiet", "-o,--out DIR", "--rays FILE|- REQUIRED".
std::string name_of(const OptionSpec& option) {
    std::string text = option.names;
    if (!option.is_flag()) text += ' ' + option.value_name;
    return text + (option.required ? " REQUIRED" : "");
}

/// "SCENE", "SCENE..." or "[SCENE]".
std::string name_of_argument(const OptionSpec& option) {
    std::string name = option.value_name;
    const ValueList* list = std::get_if<ValueList>(&option.target);
    if (list && list->count == 0) name += "...";
    return option.required ? name : '[' + name + ']';
}

bool takes_scene(const CommandSpec& command) {
    return std::ranges::any_of(command.options, [](const OptionSpec& option) {
        return option.is_argument() && option.value_name == "SCENE";
    });
}

constexpr const char* kShippedScenes =
    "scenes/examples is in the folder of the sources; installed it is share/morphray/scenes, such "
    "as "
    "/usr/share/morphray/scenes.";

bool uses_shipped_scenes(const CommandSpec& command) {
    return std::ranges::any_of(command.examples, [](const Example& example) {
        return std::string_view(example.lines).find("scenes/examples") != std::string_view::npos;
    });
}

std::string section(const char* title, const std::string& entries) {
    return entries.empty() ? std::string() : '\n' + std::string(title) + ":\n" + entries;
}

/// The length of the first word with the blanks before it. A number and what it counts are one
/// word.
std::size_t length_of_word(std::string_view text) {
    const std::size_t begin = std::min(text.find_first_not_of(' '), text.size());
    const std::size_t end = std::min(text.find_first_of(" \n", begin), text.size());
    const std::string_view word = text.substr(begin, end - begin);
    const bool is_number = word.find_first_not_of("0123456789") == std::string_view::npos;
    if (word.empty() || !is_number || end == text.size() || text[end] == '\n') return end;
    return end + length_of_word(text.substr(end));
}

std::string examples_text(std::span<const Example> examples) {
    std::string text;
    for (const Example& example : examples) {
        text += wrapped(std::string("  ") + example.does + ":", 2) + '\n';
        text += "    ";
        for (const char c : std::string_view(example.lines))
            text += c == '\n' ? std::string("\n    ") : std::string(1, c);
        text += '\n';
    }
    return text;
}

}  // namespace

std::string wrapped(std::string_view text, std::size_t indent, std::size_t columns) {
    std::string result;
    std::size_t width = 0;
    while (!text.empty()) {
        std::string_view word = text.substr(0, length_of_word(text));
        text.remove_prefix(word.size());
        if (width > 0 && width + word.size() > columns) {
            result += '\n' + std::string(indent, ' ');
            width = indent;
            word.remove_prefix(std::min(word.find_first_not_of(' '), word.size()));
        }
        result += word;
        width += word.size();
        if (!text.starts_with('\n')) continue;
        result += '\n';
        width = 0;
        text.remove_prefix(1);
    }
    return result;
}

std::string help_of(const ProgramSpec& program) {
    std::string commands;
    for (const CommandSpec& command : program.commands)
        commands += entry(command.name, command.help);
    return wrapped(program.help, 0) + "\nUsage: " + program.name + " COMMAND [OPTIONS]\n" +
           section("Options", entry(program.help_flag.names, program.help_flag.help) +
                                  entry(program.version_flag.names, program.version_flag.help) +
                                  entry(program.verbose_flag.names, program.verbose_flag.help)) +
           section("Commands", commands) + '\n' + wrapped(kCommandNote, 0) + "\n\n" +
           wrapped(kExitCodes, 0) + '\n';
}

std::string help_of(const ProgramSpec& program, const CommandSpec& command) {
    std::string usage = "Usage: " + program.name + ' ' + command.name;
    std::string arguments;
    std::string options = entry(program.help_flag.names, program.help_flag.help);
    for (const OptionSpec& option : command.options) {
        if (option.is_argument()) {
            usage += ' ' + name_of_argument(option);
            arguments += entry(name_of_argument(option), option.help);
        } else {
            options += entry(name_of(option), option.help);
        }
    }
    std::string text = wrapped(command.help, 0) + '\n' + usage + " [OPTIONS]\n" +
                       section("Arguments", arguments) + section("Options", options) +
                       section("Examples", examples_text(command.examples)) + '\n';
    if (uses_shipped_scenes(command)) text += wrapped(kShippedScenes, 0) + "\n\n";
    if (takes_scene(command)) text += wrapped(scene_note(), 0) + "\n\n";
    return text + wrapped(kExitCodes, 0) + '\n';
}

}  // namespace mray::app
