// morphray profile: measures the stages of a frame.
#include <fmt/format.h>

#include "app/backends/backends.h"
#include "app/base/process_memory.h"
#include "app/clip/frames.h"
#include "app/commands/commands.h"
#include "app/commands/profile/baseline.h"
#include "app/commands/profile/profile_head.h"
#include "app/commands/profile/profile_policies.h"
#include "app/commands/profile/shown_rows.h"
#include "app/commands/profile/stage_profiler.h"
#include "app/report/profile_report.h"
#include "app/report/profile_table.h"
#include "app/terminal/interrupt.h"
#include "app/terminal/progress.h"
#include "common/report/shell_text.h"
#include "common/version.h"

namespace mray::app {
namespace {

/// The given options that decide what is measured, apart from scene, frames, size and rays.
std::string measured_options(const Options& options) {
    std::vector<std::string> line = options.view_arguments;
    const auto add = [&line](const char* name, const std::string& value) {
        if (!value.empty()) line.insert(line.end(), {name, value});
    };
    if (options.backend.threads > 0) add("--threads", fmt::format("{}", options.backend.threads));
    add("--simd", options.backend.simd);
    add("--device", options.backend.device);
    if (options.tree.build_at) add("--build-at", fmt::format("{}", *options.tree.build_at));
    if (options.backend.validate) line.emplace_back("--validate");
    if (options.lenient) line.emplace_back("--lenient");
    return shell_line(line);
}

ProfileReport empty_report(const Options& options, const Clip& clip) {
    ProfileReport report;
    report.head = profile_head(options, clip);
    report.rays = name_of_rays(options.view.rays);
    report.repeat = options.repeat;
    report.version = kVersion;
    report.options = measured_options(options);
    return report;
}

/// Measures all frames on each backend, one backend after the other.
void measure(const Options& options, SceneFrames& scene, const std::vector<double>& frames,
             const std::vector<BackendChoice>& choices, const Messages& messages,
             const ProfileLines& lines, ShownRows& shown, ProfileReport& report) {
    Progress progress("measuring", "frame", frames.size() * choices.size(), progress_mode(options));
    for (const BackendChoice choice : choices) {
        progress.prepare("tree");
        StageProfiler profiler(options, scene, frames.front(), choice, messages);
        for (const double frame : frames) {
            throw_if_interrupted();
            progress.begin(fmt::format("frame {} on {}", frame, profiler.backend()),
                           StepPart::kShown);
            report.rows.push_back(profiler.measure(frame));
            shown.add(lines.rows(report.rows.back()));
            progress.update(report.rows.size());
        }
    }
    progress.finish();
    report.peak_memory_bytes = peak_memory_bytes();
}

void publish_profile(const ProfileReport& report, const Options& options, const ShownRows& shown) {
    if (!options.json.empty()) write_report(options.json, to_json(report));
    if (!options.csv.empty()) write_report(options.csv, profile_table(report).csv());
    shown.finish();
}

}  // namespace

ExitCode run_profile(const Options& options, const Messages& messages) {
    // A clip under several policies takes long.
    constexpr int kOtherRuns = 5;
    Options other = options;
    if (!options.is_given("--repeat")) other.repeat = kOtherRuns;
    if (!options.policies.empty() || options.tree.update) return profile_policies(other, messages);
    check_reports({options.json, options.csv});
    SceneFrames scene = open_frames(options, messages);
    const std::vector<double> frames = select_frames(options, scene.clip(), DefaultFrames::kFew);
    ProfileReport report = empty_report(options, scene.clip());
    std::optional<ProfileReport> baseline;
    const std::vector<BackendChoice> choices = profiled_backends(options, messages);
    if (!options.baseline.empty()) {
        std::vector<std::string> backends;
        for (const BackendChoice choice : choices)
            backends.push_back(make_backend(choice, options.backend, messages)->info().name);
        baseline = read_baseline(options.baseline, report, backends, frames);
    }
    const ProfileLines lines(options.repeat, frames);
    ShownRows shown(lines.header(), !takes_stdout({options.json, options.csv}), messages);
    measure(options, scene, frames, choices, messages, lines, shown, report);
    publish_profile(report, options, shown);
    if (!baseline) return ExitCode::kOk;
    const BaselineComparison comparison =
        compare_with_baseline(options.baseline, *baseline, report, options.tolerance_percent);
    if (!takes_stdout({options.json, options.csv})) messages.print(comparison.text);
    return comparison.is_slower ? ExitCode::kCheckFailed : ExitCode::kOk;
}

}  // namespace mray::app
