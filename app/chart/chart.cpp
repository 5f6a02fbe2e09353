// morphray-chart: what `morphray chart` starts (app/commands/start_chart.cpp), with all its
// arguments. Draws charts of speed against accuracy.
#include <fmt/format.h>
#include <stdlib.h>
#include <sys/stat.h>

#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <thread>

#include "app/backends/backends.h"
#include "app/base/options.h"
#include "app/clip/frames.h"
#include "app/program.h"
#include "app/terminal/failure.h"
#include "app/terminal/interrupt.h"
#include "app/terminal/messages.h"
#include "app/terminal/progress.h"
#include "common/base/errors.h"
#include "common/base/output_file.h"
#include "common/report/plot.h"
#include "common/report/shell.h"
#include "lab/accuracy/charts/charts.h"

namespace mray::app {
namespace {

using namespace accuracy;

namespace fs = std::filesystem;

[[noreturn]] void fail(const fs::path& path, const std::string& why) {
    throw Error(ErrorKind::kOutput, fmt::format("{}: {}", path.string(), why));
}

/// A temporary folder beside `path`, which keep() renames to `path`. Without keep() the destructor
/// removes it with its content.
class ChartFolder {
public:
    /// Throws Error(kOutput) if `path` exists and is not an empty folder, or if no folder can be
    /// created beside it.
    explicit ChartFolder(const std::filesystem::path& path);
    ~ChartFolder();
    ChartFolder(const ChartFolder&) = delete;
    ChartFolder& operator=(const ChartFolder&) = delete;

    void write(const std::string& name, std::string_view text) const;
    /// Renames the folder to `path`. Throws Error(kOutput).
    void keep();

private:
    std::filesystem::path path_;
    std::filesystem::path temporary_;
};

ChartFolder::ChartFolder(const fs::path& path)
    // "a/b/" would otherwise have the parent "a/b".
    : path_(path.has_filename() ? path : path.parent_path()) {
    std::error_code error;
    if (fs::exists(path_, error)) {
        if (!fs::is_directory(path_, error))
            fail(path_, "is not a folder; name one that does not exist yet");
        if (!fs::is_empty(path_, error))
            fail(path_, "is not empty; name another folder, or empty this one");
    }
    const fs::path parent = path_.has_parent_path() ? path_.parent_path() : ".";
    make_output_folder(parent);
    std::string name = (parent / (path_.filename().string() + ".partial-XXXXXX")).string();
    if (mkdtemp(name.data()) == nullptr)
        fail(path_, fmt::format("{}; choose another folder", std::strerror(errno)));
    temporary_ = name;
    // mkdtemp makes the folder private; give it the mode of any new folder.
    const mode_t mask = umask(0);
    umask(mask);
    chmod(name.c_str(), 0777 & ~mask);
}

ChartFolder::~ChartFolder() {
    std::error_code error;
    if (!temporary_.empty()) fs::remove_all(temporary_, error);
}

void ChartFolder::write(const std::string& name, std::string_view text) const {
    write_file(temporary_ / name, text);
}

void ChartFolder::keep() {
    std::error_code error;
    fs::rename(temporary_, path_, error);
    if (error) fail(path_, fmt::format("{}; choose another folder", error.message()));
    temporary_.clear();
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

std::vector<Chart> make_charts(const std::vector<SceneFrames>& scenes, const ChartContext& context,
                               Progress& progress) {
    std::vector<ChartInput> inputs;
    for (const SceneFrames& scene : scenes) inputs.push_back(middle_frame(scene));
    std::vector<Chart> charts;
    for (std::size_t i = 0; i < inputs.size(); ++i) {
        const std::string suffix = inputs.size() == 1 ? "" : fmt::format("_{}", i + 1);
        const std::string of = inputs.size() == 1 ? "" : fmt::format(" of scene {}", i + 1);
        const auto begin = [&](const char* name) { progress.begin(name + of, StepPart::kHidden); };
        begin("accuracy");
        charts.push_back(accuracy_chart(context, inputs[i], suffix));
        begin("placement");
        charts.push_back(placement_chart(context, inputs[i], suffix));
        begin("boxes");
        charts.push_back(box_chart(context, inputs[i], suffix));
    }
    progress.begin("failures", StepPart::kHidden);
    charts.push_back(failure_chart(context, inputs));
    return charts;
}

/// The folder that this one lies in.
std::filesystem::path parent_of(const std::filesystem::path& folder) {
    const auto parent = (folder.has_filename() ? folder : folder.parent_path()).parent_path();
    return parent.empty() ? "." : parent;
}

std::size_t steps_of(std::size_t scenes, const Effort& effort) {
    return scenes * (accuracy_steps() + placement_steps(effort) + box_steps() + 1) +
           failure_steps();
}

/// Writes the charts of all scenes into the folder --out, as a whole or not at all.
ExitCode draw_charts(const ChartOptions& options, const Messages& messages) {
    plot::require_gnuplot("chart");
    make_output_folder(parent_of(options.out));
    ChartFolder folder(options.out);
    std::vector<SceneFrames> scenes;
    for (const std::string& scene : options.scenes)
        scenes.emplace_back(open_clip({.scene = scene, .lenient = options.lenient}, messages));

    const Effort& effort = options.quick ? kQuickEffort : kFullEffort;
    Progress progress("charting", steps_of(scenes.size(), effort), messages);
    std::uint64_t done = 0;
    const ChartContext context{
        .effort = effort,
        .make_vulkan_backend = [&] { return make_backend(BackendChoice::kVulkan, {}, Messages()); },
        .footer = fmt::format("{}; {}", machine_text(), command_text(options)),
        .step =
            [&] {
                throw_if_interrupted();
                progress.update(++done);
            },
        .check = throw_if_interrupted};
    const std::vector<Chart> charts = make_charts(scenes, context, progress);
    for (const Chart& chart : charts) {
        throw_if_interrupted();
        const std::string csv = chart.table.csv();
        folder.write(chart.name + ".csv", csv);
        folder.write(chart.name + ".svg", plot::draw(chart.figure, csv, "svg"));
    }
    folder.keep();
    messages.print(fmt::format("{} charts: {}\n", charts.size(), options.out));
    return ExitCode::kOk;
}

ExitCode run_command(const CommandOptions& options, const Messages& messages) {
    if (const auto* chart = std::get_if<ChartOptions>(&options))
        return draw_charts(*chart, messages);
    throw Error(ErrorKind::kBadArgument, "this program draws charts alone; start morphray");
}

}  // namespace
}  // namespace mray::app

int main(int argc, char** argv) { mray::app::run_process(argc, argv, mray::app::run_command); }
