#include "app/report/plot.h"

#include <fmt/format.h>
#include <stdlib.h>
#include <unistd.h>

#include <filesystem>
#include <vector>

#include "common/base/errors.h"
#include "common/base/output_file.h"
#include "common/process/gnuplot.h"
#include "common/process/shell_command.h"
#include "common/process/shell_text.h"

namespace mray::app {
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

/// A named block of rows.
std::string block(const std::string& name, const std::vector<std::string>& rows) {
    std::string text = "$" + name + " << END_OF_BLOCK\n";
    for (const std::string& row : rows) text += row + "\n";
    return text + "END_OF_BLOCK\n";
}

/// `set title ...; plot ...` of several blocks.
class Panel {
public:
    Panel(const std::string& title, const char* x, const char* y)
        : head_(fmt::format("set title {} noenhanced\nset xlabel '{}'\nset ylabel '{}'\n",
                            gnuplot_quoted(title), x, y)) {}
    void add(const std::string& name, const std::vector<std::string>& rows,
             const std::string& title, const char* style) {
        if (rows.empty()) return;
        blocks_ += block(name, rows);
        plot_ += fmt::format("{} ${} using 1:2 with {} title {} noenhanced",
                             plot_.empty() ? "plot" : ",", name, style, gnuplot_quoted(title));
    }
    void set(const char* setting) { head_ += std::string(setting) + "\n"; }
    std::string text() const { return blocks_ + head_ + plot_ + "\nunset logscale\n"; }

private:
    std::string head_;
    std::string blocks_;
    std::string plot_;
};

template <class Value>
std::vector<std::string> by_frame(const PolicyRun& run, Value value) {
    std::vector<std::string> rows;
    for (const PolicyFrame& f : run.frames) rows.push_back(fmt::format("{} {}", f.frame, value(f)));
    return rows;
}

std::string panels_of(const PolicyComparison& comparison, std::size_t index) {
    const std::string& backend = comparison.runs.front().backend;
    Panel trace("trace on " + backend, "frame", "ms");
    Panel ratio("cost ratio on " + backend, "frame", "cost / cost at build");
    Panel total("total cost on " + backend, "frames a tree is used", "ms");
    ratio.set("set logscale y");
    total.set("set logscale x");
    for (std::size_t p = 0; p < comparison.runs.size(); ++p) {
        const PolicyRun& run = comparison.runs[p];
        const std::string tag = fmt::format("_{}_{}", index, p);
        trace.add("trace" + tag,
                  by_frame(run, [](const PolicyFrame& f) { return f.times.trace_ms; }), run.policy,
                  "linespoints");
        // A logarithmic axis cannot show 0 or infinity.
        ratio.add(
            "ratio" + tag,
            by_frame(run, [](const PolicyFrame& f) { return std::clamp(f.cost_ratio, 1e-3, 1e6); }),
            run.policy, "linespoints");
        const double used =
            static_cast<double>(run.frames.size()) / static_cast<double>(run.rebuilds() + 1);
        total.add("total" + tag, {fmt::format("{} {}", used, run.total_ms())}, run.policy,
                  "points pointsize 1.5");
    }
    std::vector<std::string> periods;
    for (std::size_t k = 1; k <= comparison.costs.first.size(); ++k) {
        const double ms = periodic_total(comparison.costs, k);
        if (ms >= 0) periods.push_back(fmt::format("{} {}", k, ms));
    }
    total.add(fmt::format("periods_{}", index), periods, "every:K", "lines");
    return trace.text() + ratio.text() + total.text();
}

std::string scaling_panel(const PolicyReport& report) {
    Panel panel("refit with transfer", "triangles", "ns a triangle");
    panel.set("set logscale xy");
    for (std::size_t b = 0; b < report.backends.size(); ++b) {
        const std::string& backend = report.backends[b].runs.front().backend;
        std::vector<std::string> rows;
        for (const RefitScaling& point : report.scaling) {
            if (point.backend != backend) continue;
            rows.push_back(fmt::format("{} {}", point.triangles,
                                       1e6 * point.ms / static_cast<double>(point.triangles)));
        }
        panel.add(fmt::format("scaling_{}", b), rows, backend, "linespoints");
    }
    return panel.text();
}

bool ends_in_png(const std::string& file) { return file.ends_with(".png"); }

std::string script_of(const PolicyReport& report, const std::string& file) {
    const std::size_t rows = report.backends.size() + (report.scaling.empty() ? 0 : 1);
    std::string text = fmt::format("set terminal {} size 1500,{}\nset multiplot layout {},3\n",
                                   ends_in_png(file) ? "png" : "svg", 400 * rows, rows);
    text += "set key outside top center horizontal\nset grid\n";
    for (std::size_t b = 0; b < report.backends.size(); ++b)
        text += panels_of(report.backends[b], b);
    if (!report.scaling.empty()) text += scaling_panel(report);
    return text + "unset multiplot\n";
}

}  // namespace

void require_plotter(const std::string& file) {
    if (!file.ends_with(".svg") && !ends_in_png(file)) {
        throw Error(ErrorKind::kBadArgument,
                    fmt::format("--plot: {} ends neither in .svg nor in .png", file));
    }
    if (has_gnuplot()) return;
    throw Error(
        ErrorKind::kUnavailable,
        "--plot: gnuplot is not installed; install gnuplot-nox, or take the figures from --csv");
}

void plot_policies(const PolicyReport& report, const std::string& file) {
    require_plotter(file);
    const ScratchFile script(script_of(report, file));
    const ShellResult output = run_shell("gnuplot " + shell_quoted(script.path()));
    if (output.status != 0 || output.text.empty()) {
        throw Error(
            ErrorKind::kInternal,
            fmt::format("gnuplot failed with exit code {}; its message is above", output.status));
    }
    write_file(file, output.text);
}

}  // namespace mray::app
