#include "report/plot.h"

#include <fmt/format.h>
#include <stdlib.h>
#include <unistd.h>

#include <nlohmann/json.hpp>

#include "common/base/errors.h"
#include "common/base/output_file.h"
#include "report/shell.h"

namespace mray::plot {
namespace {

namespace fs = std::filesystem;

struct ScratchFile {
    std::string path;
    ~ScratchFile() { unlink(path.c_str()); }
};

std::string new_scratch_path() {
    std::error_code error;
    std::string path = (fs::temp_directory_path(error) / "morphray_plot_XXXXXX").string();
    const int fd = error ? -1 : mkstemp(path.data());
    if (fd < 0)
        throw Error(ErrorKind::kOutput, "{}: cannot be created for a plot; set TMPDIR", path);
    close(fd);
    return path;
}

/// The script, where the program was built and where it is installed.
std::string script_path() {
    std::error_code error;
    const fs::path folder = fs::read_symlink("/proc/self/exe", error).parent_path();
    for (const char* place : {MORPHRAY_DATA_FROM_BIN, MORPHRAY_DATA_FROM_LIBEXEC}) {
        const fs::path path = (folder / place / "plot.py").lexically_normal();
        if (fs::exists(path, error)) return path.string();
    }
    throw Error(ErrorKind::kUnavailable,
                "{}: is missing, which draws plots; install morphray again",
                (folder / MORPHRAY_DATA_FROM_BIN / "plot.py").lexically_normal().string());
}

/// The first python3 of PATH that has matplotlib: others, as of virtual environments, may lack it.
std::string find_python() {
    return run_shell(
               "IFS=:; for d in $PATH; do \"$d/python3\" -c 'import matplotlib' 2>/dev/null && "
               "printf %s \"$d/python3\" && exit; done")
        .text;
}

}  // namespace

void require_matplotlib() {
    if (find_python().empty())
        throw Error(ErrorKind::kUnavailable,
                    "chart: no python3 in PATH has matplotlib; install the package "
                    "python3-matplotlib");
    script_path();
}

std::string draw(const Figure& figure, std::string_view csv, std::string_view format, bool narrow) {
    static const std::string python = find_python();
    const nlohmann::json spec = {{"title", figure.title},
                                 {"details", figure.details},
                                 {"panels", figure.panels},
                                 {"csv", csv}};
    const ScratchFile data{new_scratch_path()};
    write_file(data.path, spec.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
    const std::string command =
        fmt::format("{} {} {} {}{}", shell_quoted(python), shell_quoted(script_path()),
                    shell_quoted(data.path), format, narrow ? " narrow" : "");
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
    throw Error(ErrorKind::kInternal, "{}: matplotlib failed; its message is above", figure.title);
}

}  // namespace mray::plot
