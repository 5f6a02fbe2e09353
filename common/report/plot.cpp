#include "common/report/plot.h"

#include <fmt/format.h>
#include <stdlib.h>
#include <unistd.h>

#include <filesystem>
#include <utility>

#include "common/base/errors.h"
#include "common/base/output_file.h"
#include "common/report/shell.h"

namespace mray::plot {
namespace {

namespace fs = std::filesystem;

constexpr int kWidth = 1248;
/// Pixels for title and footer.
constexpr int kEdges = 70;

constexpr std::pair<const char*, std::string Panel::*> kVariables[] = {
    {"kind", &Panel::kind},     {"title", &Panel::title},   {"x", &Panel::x},
    {"y", &Panel::y},           {"series", &Panel::series}, {"xlabel", &Panel::xlabel},
    {"ylabel", &Panel::ylabel}, {"where", &Panel::where},   {"is", &Panel::is},
    {"ring", &Panel::ring},     {"least", &Panel::least},   {"logx", &Panel::logx},
    {"across", &Panel::across}, {"shade", &Panel::shade},   {"note", &Panel::note}};

/// A temporary file, removed at the end.
class ScratchFile {
public:
    explicit ScratchFile(std::string_view text)
        : path_((fs::temp_directory_path() / "morphray_plot_XXXXXX").string()) {
        const int fd = mkstemp(path_.data());
        if (fd < 0) {
            throw Error(ErrorKind::kOutput,
                        fmt::format("{}: cannot be created for gnuplot; set TMPDIR", path_));
        }
        close(fd);
        write_file(path_, text);
    }
    ~ScratchFile() { unlink(path_.c_str()); }
    ScratchFile(const ScratchFile&) = delete;
    ScratchFile& operator=(const ScratchFile&) = delete;
    const std::string& path() const { return path_; }

private:
    std::string path_;
};

/// The script beside the program where it was built, or where it is installed.
std::string script_path() {
    std::error_code error;
    const fs::path folder = fs::read_symlink("/proc/self/exe", error).parent_path();
    for (const char* place : {".", MORPHRAY_DATA_FROM_BIN, MORPHRAY_DATA_FROM_LIBEXEC}) {
        const fs::path path = (folder / place / "plot.gp").lexically_normal();
        if (fs::exists(path, error)) return path.string();
    }
    throw Error(ErrorKind::kUnavailable,
                fmt::format("{}: is missing, which gnuplot needs; install morphray again",
                            (folder / "plot.gp").string()));
}

/// Single quotes, in which gnuplot expands nothing.
std::string quote(std::string_view text) {
    std::string result = "'";
    for (const char c : text) {
        if (c != '\n' && c != '\r') result.append(c == '\'' ? 2 : 1, c);
    }
    return result + "'";
}

/// The variables of the script.
std::string settings(const Figure& figure, const std::string& csv, std::string_view format) {
    const int panels = static_cast<int>(figure.panels.size());
    const int rows = (panels + figure.columns - 1) / figure.columns;
    std::string text = fmt::format("width={};height={};columns={};panels={}", kWidth,
                                   rows * figure.panel_height + kEdges, figure.columns, panels);
    const auto set = [&text](const std::string& name, std::string_view value) {
        if (!value.empty()) text += fmt::format(";{}={}", name, quote(value));
    };
    set("csv", csv);
    set("format", format);
    text += fmt::format(";title={};footer={}", quote(figure.title), quote(figure.footer));
    for (int i = 0; i < panels; ++i) {
        const Panel& panel = figure.panels[static_cast<std::size_t>(i)];
        for (const auto& [name, value] : kVariables)
            set(fmt::format("{}{}", name, i + 1), panel.*value);
    }
    return text;
}

}  // namespace

void require_gnuplot(std::string_view who) {
    if (run_shell("command -v gnuplot").status != 0) {
        throw Error(
            ErrorKind::kUnavailable,
            fmt::format("{}: gnuplot is not installed; install the package gnuplot-nox", who));
    }
    script_path();
}

std::string draw(const Figure& figure, std::string_view csv, std::string_view format) {
    const ScratchFile data(csv);
    const std::string command =
        fmt::format("gnuplot -e {} {}", shell_quoted(settings(figure, data.path(), format)),
                    shell_quoted(script_path()));
    const ShellResult finished = run_shell(command + " 2>/dev/null");
    if (finished.status == 0) return finished.text;
    // Again, for its message; warnings are of no interest.
    run_shell(command);
    throw Error(ErrorKind::kInternal,
                fmt::format("{}: gnuplot failed; its message is above", figure.title));
}

}  // namespace mray::plot
