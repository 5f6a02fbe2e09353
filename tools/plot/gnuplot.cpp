#include "tools/plot/gnuplot.h"

#include <fmt/format.h>
#include <stdlib.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>

#include "common/base/errors.h"
#include "common/base/output_file.h"
#include "tools/plot/gnuplot_script.h"
#include "tools/process/shell_command.h"
#include "tools/process/shell_text.h"

namespace mray::plot {
namespace {

namespace fs = std::filesystem;

/// A temporary file, removed at the end.
class ScratchFile {
public:
    explicit ScratchFile(const std::string& text)
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

}  // namespace

bool has_gnuplot() { return run_shell("command -v gnuplot").status == 0; }

std::string run_gnuplot(const std::string& folder, const std::string& script) {
    const ScratchFile messages("");
    const ShellResult finished = run_shell(
        fmt::format("cd {} && gnuplot {} 2>{}", shell_quoted(folder.empty() ? "." : folder),
                    shell_quoted(script), shell_quoted(messages.path())));
    if (finished.status == 0) return finished.text;
    std::string why = run_shell("cat " + shell_quoted(messages.path())).text;
    std::ranges::replace(why, '\n', ' ');
    throw Error(ErrorKind::kInternal, fmt::format("{}: gnuplot: {}", script, why));
}

std::string svg_of(const Figure& figure) {
    const ScratchFile script(script_of(figure, {{Image::kSvg, ""}}));
    return run_gnuplot("", script.path());
}

void draw(const Figure& figure, const std::string& file) {
    const Image image = file.ends_with(".png") ? Image::kPng : Image::kSvg;
    const ScratchFile script(script_of(figure, {{image, ""}}));
    write_file(file, run_gnuplot("", script.path()));
}

}  // namespace mray::plot
