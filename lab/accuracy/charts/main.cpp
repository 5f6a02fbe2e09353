// morphray-chart --out DIR [--quick] [--lenient] [--quiet] SCENE...: draws charts of speed against
// accuracy. `morphray chart` starts it (app/commands/chart_and_view.cpp).
#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <thread>

#include "common/base/errors.h"
#include "common/base/output_file.h"
#include "common/report/plot.h"
#include "common/report/shell.h"
#include "gpu/vulkan_backend.h"
#include "lab/accuracy/charts/charts.h"
#include "scenes/animation.h"

namespace mray::accuracy {
namespace {

namespace fs = std::filesystem;

struct Options {
    std::vector<std::string> scenes;
    std::string out;
    bool quick = false;
    bool lenient = false;
    bool quiet = false;
};

Options parse(std::vector<std::string> arguments) {
    if (arguments.size() < 3 || arguments[0] != "--out")
        throw Error(ErrorKind::kBadArgument, "needs --out and a scene; start `morphray chart`");
    Options options;
    options.out = arguments[1];
    arguments.erase(arguments.begin(), arguments.begin() + 2);
    options.quick = std::erase(arguments, "--quick") > 0;
    options.lenient = std::erase(arguments, "--lenient") > 0;
    options.quiet = std::erase(arguments, "--quiet") > 0;
    options.scenes = std::move(arguments);
    return options;
}

/// Throws Error(kOutput) unless the folder is empty or can be made.
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

std::string machine_text() {
    std::string model = "unknown processor";
    std::ifstream file("/proc/cpuinfo");
    for (std::string line; std::getline(file, line);) {
        if (!line.starts_with("model name") || line.find(": ") == std::string::npos) continue;
        model = line.substr(line.find(": ") + 2);
        break;
    }
    return fmt::format("{}, {} threads", model, std::thread::hardware_concurrency());
}

std::string command_text(const Options& options) {
    std::vector<std::string> arguments{"morphray", "chart"};
    arguments.insert(arguments.end(), options.scenes.begin(), options.scenes.end());
    arguments.insert(arguments.end(), {"--out", options.out});
    if (options.quick) arguments.emplace_back("--quick");
    if (options.lenient) arguments.emplace_back("--lenient");
    return shell_line(arguments);
}

/// The middle frame of a scene.
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

/// Writes the charts of all scenes into the folder --out, when all are made.
void draw_charts(const Options& options) {
    plot::require_gnuplot("chart");
    require_new_folder(options.out);
    std::vector<ChartInput> inputs;
    for (const std::string& scene : options.scenes)
        inputs.push_back(read_input(scene, options.lenient));
    const std::vector<Chart> charts = make_charts(
        inputs, {.effort = options.quick ? kQuickEffort : kFullEffort,
                 .make_vulkan_backend = open_vulkan,
                 .footer = fmt::format("{}; {}", machine_text(), command_text(options))});
    make_output_folder(options.out);
    for (const Chart& chart : charts) {
        const std::string csv = chart.table.csv();
        const fs::path file = fs::path(options.out) / chart.name;
        write_file(file.string() + ".csv", csv);
        write_file(file.string() + ".svg", plot::draw(chart.figure, csv, "svg"));
    }
    if (!options.quiet) fmt::print("{} charts: {}\n", charts.size(), options.out);
}

constexpr int kInternal = 70;

/// The exit codes of `morphray` (app/terminal/failure.h), which are in the order of the kinds.
int exit_code_of(ErrorKind kind) {
    return kind <= ErrorKind::kDeviceLost ? 2 + static_cast<int>(kind) : kInternal;
}

}  // namespace
}  // namespace mray::accuracy

int main(int argc, char** argv) {
    try {
        mray::accuracy::draw_charts(mray::accuracy::parse({argv + 1, argv + argc}));
        return 0;
    } catch (const mray::Error& error) {
        const bool begins_with_file =
            error.kind() == mray::ErrorKind::kBadInput || error.kind() == mray::ErrorKind::kOutput;
        fmt::print(stderr, "{}{}\n", begins_with_file ? "" : "morphray: ", error.what());
        return mray::accuracy::exit_code_of(error.kind());
    } catch (const std::exception& error) {
        fmt::print(stderr, "morphray: internal error: {}; please report it\n", error.what());
        return mray::accuracy::kInternal;
    }
}
