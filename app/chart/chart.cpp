#include "app/chart/chart.h"

#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <thread>

#include "app/backends/backends.h"
#include "app/clip/frames.h"
#include "app/terminal/interrupt.h"
#include "app/terminal/progress.h"
#include "common/base/errors.h"
#include "common/base/output_file.h"
#include "common/report/plot.h"
#include "common/report/shell_text.h"
#include "lab/accuracy/charts/chart_folder.h"
#include "lab/accuracy/charts/chart_page.h"
#include "lab/accuracy/charts/charts.h"

namespace mray::app {
namespace {

using namespace accuracy;

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

std::string command_text(const ChartOptions& options) {
    std::vector<std::string> arguments{"morphray", "chart"};
    arguments.insert(arguments.end(), options.scenes.begin(), options.scenes.end());
    arguments.insert(arguments.end(), {"--out", options.out});
    if (options.quick) arguments.emplace_back("--quick");
    if (options.lenient) arguments.emplace_back("--lenient");
    return shell_line(arguments);
}

/// The middle frame of a scene.
ChartInput middle_frame(const SceneFrames& frames) {
    const Clip& clip = frames.clip();
    const Topology& topology = clip.topology();
    std::vector<vec3> positions(topology.vertex_count);
    clip.positions(std::floor((clip.first_frame() + clip.last_frame()) / 2), positions);
    return {std::filesystem::path(clip.name()).filename().string(), topology, std::move(positions)};
}

std::vector<Chart> make_charts(std::vector<SceneFrames>& scenes, const ChartContext& context,
                               Progress& progress) {
    std::vector<ChartInput> inputs;
    for (SceneFrames& scene : scenes) inputs.push_back(middle_frame(scene));
    std::vector<Chart> charts;
    for (std::size_t i = 0; i < inputs.size(); ++i) {
        const std::string suffix = inputs.size() == 1 ? "" : fmt::format("_{}", i + 1);
        const std::string of = inputs.size() == 1 ? "" : fmt::format(" of scene {}", i + 1);
        const auto begin = [&](const char* name) { progress.begin(name + of, StepPart::kHidden); };
        begin("accuracy");
        charts.push_back(accuracy_chart(context, inputs[i], suffix));
        begin("placement");
        charts.push_back(placement_chart(context, inputs[i], suffix));
        begin("packets");
        charts.push_back(packet_chart(context, inputs[i], suffix));
        begin("cones");
        charts.push_back(cone_chart(context, inputs[i], suffix));
        begin("policies");
        charts.push_back(policy_chart(context, scenes[i], suffix));
        begin("trees");
        charts.push_back(tree_chart(context, scenes[i], suffix));
        begin("boxes");
        charts.push_back(box_chart(context, inputs[i], suffix));
    }
    progress.begin("failures", StepPart::kHidden);
    charts.push_back(failure_chart(context, inputs));
    progress.begin("scaling", StepPart::kHidden);
    charts.push_back(scaling_chart(context));
    return charts;
}

/// The folder that this one lies in.
std::filesystem::path parent_of(const std::filesystem::path& folder) {
    const auto parent = (folder.has_filename() ? folder : folder.parent_path()).parent_path();
    return parent.empty() ? "." : parent;
}

std::size_t steps_of(std::size_t scenes, const Effort& effort) {
    return scenes * (accuracy_steps() + placement_steps(effort) + packet_steps() + cone_steps() +
                     policy_steps() + tree_steps() + box_steps() + 1) +
           failure_steps() + scaling_steps(effort);
}

}  // namespace

ExitCode draw_charts(const ChartOptions& options, const Messages& messages) {
    plot::require_gnuplot("chart");
    make_output_folder(parent_of(options.out));
    ChartFolder folder(options.out);
    std::vector<SceneFrames> scenes;
    for (const std::string& scene : options.scenes)
        scenes.emplace_back(open_clip({.scene = scene, .lenient = options.lenient}, messages));

    const Effort& effort = options.quick ? quick_effort() : full_effort();
    const std::string machine = machine_text();
    const std::string command = command_text(options);
    Progress progress("charting", steps_of(scenes.size(), effort), messages);
    std::uint64_t done = 0;
    const auto backend_maker = [](BackendChoice choice) {
        return [choice] { return make_backend(choice, {}, Messages()); };
    };
    const ChartContext context{.effort = effort,
                               .threads = 0,
                               .make_cpu_backend = backend_maker(BackendChoice::kCpu),
                               .make_vulkan_backend = backend_maker(BackendChoice::kVulkan),
                               .footer = fmt::format("{}; {}", machine, command),
                               .step =
                                   [&] {
                                       throw_if_interrupted();
                                       progress.update(++done);
                                   },
                               .check = throw_if_interrupted};
    const std::vector<Chart> charts = make_charts(scenes, context, progress);
    std::vector<PagedChart> paged;
    for (const Chart& chart : charts) {
        throw_if_interrupted();
        PagedChart& page = paged.emplace_back(&chart);
        if (chart.figure.panels.empty()) continue;
        const std::string csv = chart.table.csv();
        page.svg = plot::draw(chart.figure, csv, "svg");
        folder.write(chart.name + ".csv", csv);
        folder.write(chart.name + ".svg", page.svg);
        folder.write(chart.name + ".png", plot::draw(chart.figure, csv, "png"));
    }
    folder.write("index.html", chart_page(paged, machine, command));
    folder.keep();
    messages.print(fmt::format("{} charts: {}\n", charts.size(),
                               (std::filesystem::path(options.out) / "index.html").string()));
    return ExitCode::kOk;
}

}  // namespace mray::app
