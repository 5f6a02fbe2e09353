#include "report/plot.h"

#include <fmt/format.h>
#include <stdlib.h>
#include <unistd.h>

#include <filesystem>
#include <utility>

#include "common/base/errors.h"
#include "common/base/output_file.h"
#include "common/text/text.h"
#include "report/shell.h"

namespace mray::plot {
namespace {

namespace fs = std::filesystem;

/// The mean width of a character, in pixels.
constexpr double kCharacter = 8.5;

/// A temporary file, removed at the end.
struct ScratchFile {
    std::string path;
    ~ScratchFile() { unlink(path.c_str()); }
};

std::string new_scratch_path() {
    std::error_code error;
    std::string path = (fs::temp_directory_path(error) / "morphray_plot_XXXXXX").string();
    const int fd = error ? -1 : mkstemp(path.data());
    if (fd < 0)
        throw Error(ErrorKind::kOutput, "{}: cannot be created for gnuplot; set TMPDIR", path);
    close(fd);
    return path;
}

/// The script, where the program was built and where it is installed.
std::string script_path() {
    std::error_code error;
    const fs::path folder = fs::read_symlink("/proc/self/exe", error).parent_path();
    for (const char* place : {MORPHRAY_DATA_FROM_BIN, MORPHRAY_DATA_FROM_LIBEXEC}) {
        const fs::path path = (folder / place / "plot.gp").lexically_normal();
        if (fs::exists(path, error)) return path.string();
    }
    throw Error(ErrorKind::kUnavailable,
                "{}: is missing, which gnuplot needs; install morphray again",
                (folder / MORPHRAY_DATA_FROM_BIN / "plot.gp").lexically_normal().string());
}

/// Single quotes, in which gnuplot expands nothing.
std::string quoted(std::string_view text) {
    std::string result = "'";
    for (const char c : text) {
        if (c != '\n' && c != '\r') result.append(c == '\'' ? 2 : 1, c);
    }
    return result + "'";
}

std::string settings(const Figure& figure, const std::string& csv, std::string_view format) {
    std::string text = fmt::format("width={};panel_height={};panels={}", figure.width,
                                   figure.panel_height, figure.panels.size());
    const auto set = [&text](const std::string& name, std::string_view value) {
        if (!value.empty()) text += fmt::format(";{}={}", name, quoted(value));
    };
    const auto line_length = static_cast<std::size_t>((figure.width - 10) / kCharacter);
    set("csv", csv);
    set("format", format);
    for (const auto& [name, long_text] :
         {std::pair{"head", figure.title}, {"foot", figure.footer}}) {
        const std::string short_lines = wrapped(long_text, 0, line_length);
        const std::vector<std::string_view> lines = split(short_lines, '\n');
        text += fmt::format(";{}s={}", name, short_lines.empty() ? 0 : lines.size());
        for (std::size_t i = 0; i < lines.size(); ++i)
            set(fmt::format("{}{}", name, i + 1), lines[i]);
    }
    for (std::size_t i = 0; i < figure.panels.size(); ++i)
        for (const auto& [name, value] : figure.panels[i])
            set(fmt::format("{}{}", name, i + 1), value);
    return text;
}

}  // namespace

void require_gnuplot(std::string_view who) {
    if (run_shell("command -v gnuplot").status != 0)
        throw Error(ErrorKind::kUnavailable,
                    "{}: gnuplot is not installed; install the package gnuplot-nox", who);
    script_path();
}

std::string draw(const Figure& figure, std::string_view csv, std::string_view format) {
    const ScratchFile data{new_scratch_path()};
    write_file(data.path, csv);
    const std::string command =
        fmt::format("gnuplot -e {} {}", shell_quoted(settings(figure, data.path, format)),
                    shell_quoted(script_path()));
    ShellResult finished = run_shell(command + " 2>/dev/null");
    if (finished.status == 0) {
        constexpr std::string_view kRoot = "<svg";
        if (const std::size_t at = finished.text.find(kRoot);
            format == "svg" && at < finished.text.size())
            finished.text.insert(at + kRoot.size(), " style=\"max-width:100%;height:auto\"");
        return finished.text;
    }
    // Again, for its message; warnings are of no interest.
    run_shell(command);
    throw Error(ErrorKind::kInternal, "{}: gnuplot failed; its message is above", figure.title);
}

}  // namespace mray::plot
