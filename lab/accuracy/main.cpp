// morphray-chart DIR FLAGS SCENE...: draws charts of speed against accuracy; FLAGS has q for quick,
// l for lenient, s for silent. `morphray chart` starts it (app/commands/chart.cpp).
#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <filesystem>

#include "common/base/errors.h"
#include "common/base/output_file.h"
#include "gpu/vulkan_backend.h"
#include "lab/accuracy/charts.h"
#include "report/machine.h"
#include "report/plot.h"
#include "report/shell.h"
#include "scenes/animation.h"

namespace mray::lab {
namespace {

namespace fs = std::filesystem;

struct Options {
    std::vector<std::string> scenes;
    std::string out;
    bool quick = false;
    bool lenient = false;
    bool quiet = false;
};

Options parse(const std::vector<std::string>& arguments) {
    if (arguments.size() < 3)
        throw Error(ErrorKind::kBadArgument, "start `morphray chart` instead");
    const auto has = [&](char flag) { return arguments[1].find(flag) != std::string::npos; };
    return {{arguments.begin() + 2, arguments.end()}, arguments[0], has('q'), has('l'), has('s')};
}

void require_new_folder(const fs::path& path) {
    std::error_code error;
    if (!fs::exists(path, error)) return;
    if (!fs::is_directory(path, error))
        throw Error(ErrorKind::kOutput,
                    path.string() + ": is not a folder; name one that does not exist yet");
    if (!fs::is_empty(path, error))
        throw Error(ErrorKind::kOutput,
                    path.string() + ": is not empty; name another folder, or empty this one");
}

ChartInput read_input(const std::string& scene, bool lenient) {
    AnimationOptions options;
    options.lenient = lenient;
    options.warn = [](const Warning& warning) {
        fmt::print(stderr, "{}{}\n", warning.place.empty() ? "morphray: " : "", warning.line());
    };
    const std::unique_ptr<Animation> animation = open_scene(scene, options);
    std::vector<vec3> positions(animation->topology().vertex_count);
    animation->positions(std::floor((animation->first_frame() + animation->last_frame()) / 2),
                         positions);
    return {fs::path(animation->name()).filename().string(), animation->topology(),
            std::move(positions)};
}

std::unique_ptr<Backend> open_vulkan() {
#ifdef MORPHRAY_HAS_VULKAN
    return gpu::make_vulkan_backend();
#else
    throw Error(ErrorKind::kUnavailable, "Vulkan: not built in; build with -DMORPHRAY_VULKAN=ON");
#endif
}

std::vector<Chart> make_charts(const std::vector<ChartInput>& inputs, const ChartContext& context) {
    std::vector<Chart> charts;
    for (std::size_t i = 0; i < inputs.size(); ++i) {
        const std::string suffix = inputs.size() == 1 ? "" : fmt::format("_{}", i + 1);
        charts.push_back(accuracy_chart(context, inputs[i], suffix));
    }
    charts.push_back(failure_chart(context, inputs));
    return charts;
}

constexpr const char* kMethods = R"(<dl>
<dt>scalar</dt><dd>our tracer without vectors, one ray at a time</dd>
<dt>single, packets</dt><dd>our tracers on the CPU with its best instruction set</dd>
<dt>Vulkan</dt><dd>our tracer on a device, its transfers included</dd>
<dt>rule: ours</dt><dd>our hit rule in one plain traversal, one ray at a time</dd>
<dt>rule: Moeller-Trumbore, Woop</dt><dd>other hit rules in the same traversal, of 1997 and of 2013</dd>
<dt>Embree fast, robust</dt><dd>Intersect1 without and with the flag ROBUST</dd>
</dl>
)";

std::string page_of(const std::vector<Chart>& charts) {
    std::string contents;
    std::string figures;
    for (const Chart& chart : charts) {
        const std::string title = markup_text(chart.figure.title);
        contents += fmt::format("<li><a href=\"#{0}\">{0}</a>: {1}</li>\n", chart.name, title);
        figures += fmt::format(
            "<h2 id=\"{0}\">{0}</h2>\n<img src=\"{0}.svg\" alt=\"{1}\">\n"
            "<p><a href=\"{0}.csv\">Numbers</a></p>\n{2}",
            chart.name, title, kMethods);
    }
    return fmt::format(
        "<!DOCTYPE html>\n<html lang=\"en\"><meta charset=\"utf-8\">\n"
        "<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\n"
        "<title>morphray chart</title>\n"
        "<style>:root {{ color-scheme: light dark }}\n"
        "body {{ font: 16px/1.5 sans-serif; max-width: 40rem; margin: auto; padding: 1rem "
        "}}\n"
        "img {{ max-width: 100% }} dt {{ font-weight: bold }}</style>\n"
        "<h1>morphray chart</h1>\n<ul>\n{}</ul>\n{}</html>\n",
        contents, figures);
}

void draw_charts(const Options& options) {
    plot::require_gnuplot("chart");
    require_new_folder(options.out);
    std::vector<ChartInput> inputs;
    for (const std::string& scene : options.scenes)
        inputs.push_back(read_input(scene, options.lenient));
    const std::vector<Chart> charts = make_charts(
        inputs,
        {.effort = options.quick ? kQuickEffort : kFullEffort,
         .make_vulkan_backend = open_vulkan,
         .footer = fmt::format("{}; morphray chart {}{}", machine_name(),
                               shell_line(options.scenes), options.quick ? " --quick" : "")});
    make_output_folder(options.out);
    for (const Chart& chart : charts) {
        const std::string csv = chart.table.csv();
        const fs::path file = fs::path(options.out) / chart.name;
        write_file(file.string() + ".csv", csv);
        write_file(file.string() + ".svg", plot::draw(chart.figure, csv, "svg"));
    }
    const std::string page = (fs::path(options.out) / "index.html").string();
    write_file(page, page_of(charts));
    if (options.quiet) return;
    for (const Chart& chart : charts) fmt::print("{}: {}\n", chart.name, chart.figure.title);
    fmt::print("all charts: {}\n", page);
}

constexpr int kInternal = 70;

/// The exit codes of `morphray` (app/base/messages.h), which are in the order of the kinds.
int exit_code_of(ErrorKind kind) {
    return kind <= ErrorKind::kDeviceLost ? 2 + static_cast<int>(kind) : kInternal;
}

}  // namespace
}  // namespace mray::lab

int main(int argc, char** argv) {
    try {
        mray::lab::draw_charts(mray::lab::parse({argv + 1, argv + argc}));
        return 0;
    } catch (const mray::Error& error) {
        const bool begins_with_file =
            error.kind() == mray::ErrorKind::kBadInput || error.kind() == mray::ErrorKind::kOutput;
        fmt::print(stderr, "{}{}\n", begins_with_file ? "" : "morphray: ", error.what());
        return mray::lab::exit_code_of(error.kind());
    } catch (const std::exception& error) {
        fmt::print(stderr, "morphray: internal error: {}; please report it\n", error.what());
        return mray::lab::kInternal;
    }
}
