// morphray-chart DIR FLAGS SCENE...: draws charts of speed against accuracy; FLAGS has q for quick,
// l for lenient, s for silent. `morphray chart` starts it (app/commands/chart.cpp).
#include <fmt/format.h>
#include <tbb/task_arena.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>

#include "common/base/errors.h"
#include "common/base/output_file.h"
#include "common/frame_times.h"
#include "common/version.h"
#include "lab/accuracy/charts.h"
#include "report/machine.h"
#include "report/plot.h"
#include "report/shell.h"
#include "scenes/animation.h"

namespace mray::lab {
namespace {

namespace fs = std::filesystem;

void require_new_folder(const fs::path& path) {
    std::error_code error;
    if (fs::exists(path, error) && !(fs::is_directory(path, error) && fs::is_empty(path, error)))
        throw Error(ErrorKind::kOutput,
                    path.string() + ": is not an empty folder; name one that does not exist yet");
}

ChartInput read_input(const std::string& scene, bool lenient, int most_frames) {
    AnimationOptions options;
    options.lenient = lenient;
    options.warn = [](const Warning& warning) {
        fmt::print(stderr, "{}{}\n", warning.place.empty() ? "morphray: " : "", warning.line());
    };
    const std::unique_ptr<Animation> animation = open_scene(scene, options);
    ChartInput input{fs::path(animation->name()).filename().string(), animation->topology(), {}};
    const auto positions_at = [&](double frame) {
        std::vector<vec3> positions(animation->topology().vertex_count);
        animation->positions(frame, positions);
        return positions;
    };
    const double first = animation->first_frame();
    const double last = animation->last_frame();
    input.positions = positions_at(std::floor((first + last) / 2));
    if (last > first) {
        const double step = std::max(1.0, std::floor((last - first) / (most_frames - 1)));
        for (double frame = first; frame <= last; frame += step) {
            input.frame_numbers.push_back(frame);
            input.frames.push_back(positions_at(frame));
        }
    }
    return input;
}

/// Says on a terminal how much is done and how long it will take.
struct Progress {
    std::size_t steps;
    bool shown;
    std::size_t done = 0;
    Stopwatch watch = {};

    ~Progress() {
        if (shown) fmt::print(stderr, "\r{:40}\r", "");
    }

    void step() {
        ++done;
        if (!shown) return;
        const double left =
            1e-3 * watch.ms() * static_cast<double>(steps - done) / static_cast<double>(done);
        fmt::print(stderr, "\rcharts: {} %, about {} s to go   ", 100 * done / steps,
                   std::lround(left));
        std::fflush(stderr);
    }
};

constexpr const char* kMethods = R"(<dl>
<dt>brute force, scalar, singles, streams, packets, light packets</dt>
<dd>our tracers on the CPU: every triangle; a tree without vectors; the best instruction set with a
ray a call, the rays of a tile a call, and 64 x 64 rays with a common origin</dd>
<dt>Vulkan</dt><dd>our tracer on a device, its transfers included</dd>
<dt>GPU peer</dt><dd>two boxes a node, one ray a lane, the rule of Moeller and Trumbore, likewise</dd>
<dt>2007 packets</dt><dd>16 x 16 rays as by Wald, Boulos and Shirley, in wider vectors</dd>
<dt>Embree</dt><dd>1 or 16 rays a call; fast or with the flag ROBUST; a MEDIUM tree or a HIGH one,
which has spatial splits</dd>
<dt>rule</dt><dd>rules from the literature in one plain binary tree, a ray at a time: Moeller and
Trumbore 1997, Woop, Benthin and Wald 2013, Baldwin and Weber 2016, and the first in doubles</dd>
</dl>
)";

std::string page_of(const std::vector<Chart>& charts, const std::string& details) {
    std::string figures;
    for (const Chart& chart : charts) {
        for (const auto& [name, figure, notes] : chart.figures) {
            std::string items;
            for (const std::string& note : notes)
                items += fmt::format("<li>{}</li>\n", markup_text(note));
            figures += fmt::format(
                "<section id=\"{0}\">\n<picture><source media=\"(max-width:600px)\" "
                "srcset=\"{0}_narrow.svg\"><img src=\"{0}.svg\" alt=\"{1}\"></picture>\n"
                "<ul>\n{2}</ul>\n<p><a href=\"{0}.pdf\">PDF of one column</a>, "
                "<a href=\"{3}.csv\">numbers</a></p>\n</section>\n",
                name, markup_text(figure.title), items, chart.name);
        }
    }
    return fmt::format(
        "<!DOCTYPE html>\n<html lang=\"en\"><meta charset=\"utf-8\">\n"
        "<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\n"
        "<title>morphray chart</title>\n"
        "<style>:root {{ color-scheme: light dark }}\n"
        "body {{ font: 16px/1.5 sans-serif; max-width: 62rem; margin: auto; padding: 1rem }}\n"
        "img {{ width: 100% }} section {{ margin-bottom: 3rem }}\n"
        "dt {{ font-weight: bold }}</style>\n"
        "{}<h2>Machine</h2>\n<p>{}</p>\n<h2>Methods</h2>\n{}</html>\n",
        figures, markup_text(details), kMethods);
}

void write_chart(const fs::path& folder, const Chart& chart) {
    const std::string csv = chart.table.csv();
    write_file(folder / (chart.name + ".csv"), csv);
    for (const ChartFigure& one : chart.figures) {
        const std::string file = (folder / one.name).string();
        write_file(file + ".svg", plot::draw(one.figure, csv, "svg"));
        write_file(file + "_narrow.svg", plot::draw(one.figure, csv, "svg", true));
        write_file(file + ".pdf", plot::draw(one.figure, csv, "pdf", true));
    }
}

void draw_charts(const std::vector<std::string>& arguments) {
    if (arguments.size() < 3)
        throw Error(ErrorKind::kBadArgument, "start `morphray chart` instead");
    const fs::path out = arguments[0];
    const auto has = [&](char flag) { return arguments[1].find(flag) != std::string::npos; };
    const bool quick = has('q');
    const bool quiet = has('s');
    const auto scenes = std::span(arguments).subspan(2);
    plot::require_matplotlib();
    require_new_folder(out);
    std::vector<ChartInput> inputs;
    for (const std::string& scene : scenes)
        inputs.push_back(read_input(scene, has('l'), quick ? 8 : 24));
    const Effort& effort = quick ? kQuickEffort : kFullEffort;
    Progress progress{count_steps(effort, inputs), !quiet && isatty(STDERR_FILENO) == 1};
    ChartContext context{.effort = effort, .devices = open_devices(), .details = {}, .done = [&] {
                             progress.step();
                         }};
    context.details = fmt::format("{}; {}, {} threads; ", machine_name(), best_simd_target().name,
                                  tbb::this_task_arena::max_concurrency());
    for (const ChartDevice& device : context.devices) context.details += device.detail + "; ";
    context.details += fmt::format("{}; morphray {}; morphray chart {}{}", embree_name(),
                                   kVersionDetail, shell_line(scenes), quick ? " --quick" : "");
    std::vector<Chart> charts;
    for (std::size_t i = 0; i < inputs.size(); ++i) {
        const std::string suffix = inputs.size() == 1 ? "" : fmt::format("_{}", i + 1);
        charts.push_back(accuracy_chart(context, inputs[i], suffix));
        if (!inputs[i].frames.empty())
            charts.push_back(deformation_chart(context, inputs[i], suffix));
    }
    charts.push_back(failure_chart(context, inputs));
    make_output_folder(out);
    for (const Chart& chart : charts) write_chart(out, chart);
    const std::string page = (out / "index.html").string();
    write_file(page, page_of(charts, context.details));
    if (quiet) return;
    for (const Chart& chart : charts)
        for (const auto& [name, figure, notes] : chart.figures)
            fmt::print("{}: {}\n{}{}", name, figure.title, fmt::join(notes, "\n"),
                       notes.empty() ? "" : "\n");
    fmt::print("all charts: {}\n", page);
}

constexpr int kInternal = 70;

}  // namespace
}  // namespace mray::lab

int main(int argc, char** argv) {
    try {
        mray::lab::draw_charts({argv + 1, argv + argc});
        return 0;
    } catch (const mray::Error& error) {
        const bool begins_with_file =
            error.kind() == mray::ErrorKind::kBadInput || error.kind() == mray::ErrorKind::kOutput;
        fmt::print(stderr, "{}{}\n", begins_with_file ? "" : "morphray: ", error.what());
        // The exit codes of `morphray` (app/base/messages.h) are in the order of the kinds.
        return error.kind() <= mray::ErrorKind::kDeviceLost ? 2 + static_cast<int>(error.kind())
                                                            : mray::lab::kInternal;
    } catch (const std::exception& error) {
        fmt::print(stderr, "morphray: internal error: {}; please report it\n", error.what());
        return mray::lab::kInternal;
    }
}
