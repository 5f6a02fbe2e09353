#include "app/commands/profile/profile_policies.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <utility>

#include "app/backends/backends.h"
#include "app/clip/frames.h"
#include "app/commands/profile/profile_head.h"
#include "app/commands/profile/shown_rows.h"
#include "app/report/policy_plot.h"
#include "app/report/policy_report.h"
#include "app/report/trace_events.h"
#include "app/terminal/interrupt.h"
#include "app/terminal/progress.h"
#include "tools/measure/median.h"
#include "tools/measure/policy_runs.h"

namespace mray::app {
namespace {

/// Times refits of a built-in scene at four sizes up to its own, on each backend. Returns nothing
/// for files, which have one size only.
std::vector<RefitScaling> measure_scaling(const Options& options,
                                          const std::vector<BackendChoice>& choices,
                                          std::uint64_t triangles, const Messages& messages) {
    if (!options.scene.starts_with("builtin:")) return {};
    const std::string name = options.scene.substr(0, options.scene.find(':', 8));
    std::vector<RefitScaling> scaling;
    for (const std::uint64_t divisor : {64, 16, 4, 1}) {
        SceneFrames scene(open_scene(
            fmt::format("{}:{}", name, std::max<std::uint64_t>(1, triangles / divisor))));
        const Topology& topology = scene.clip().topology();
        for (const BackendChoice choice : choices) {
            const auto backend = make_backend(choice, options.backend, messages);
            const std::span<const vec3> start = scene.positions(scene.clip().first_frame());
            backend->set_scene(topology, start, build_bvh(topology, start));
            std::vector<double> times;
            for (int i = 0; i <= options.repeat; ++i) {
                throw_if_interrupted();
                backend->refit(scene.positions(i % 2 == 0 ? 1 : 2), RefitExtent::kAll);
                // The first run warms up.
                if (i > 0) times.push_back(backend->finish().update.total_ms());
            }
            scaling.push_back({backend->info().name, topology.triangles.size(), median(times)});
        }
    }
    return scaling;
}

void publish(const PolicyReport& report, const Options& options, const ShownRows& shown,
             const Messages& messages) {
    if (!options.json.empty()) write_report(options.json, to_json(report));
    if (!options.csv.empty()) write_report(options.csv, policy_frames_table(report.backends).csv());
    if (!options.trace_events.empty()) write_report(options.trace_events, trace_events(report));
    if (!options.plot.empty()) plot_policies(report, options.plot);
    shown.finish();
    if (!takes_stdout({options.json, options.csv, options.trace_events}))
        messages.print("\n" + policy_text(report));
}

}  // namespace

ExitCode profile_policies(const Options& options, const Messages& messages) {
    check_reports({options.json, options.csv, options.trace_events, options.plot});
    if (!options.plot.empty()) require_plotter(options.plot);
    SceneFrames scene = open_frames(options, messages);
    const std::vector<double> frames = select_frames(options, scene.clip(), DefaultFrames::kAll);
    warn_of_damage(options, scene.clip(), frames, messages);
    PolicyReport report;
    report.head = profile_head(options, scene.clip());
    report.rays = name_of_rays(options.view.rays);
    report.repeat = options.repeat;
    const std::vector<BackendChoice> choices = profiled_backends(options, messages);
    const std::vector<PolicySpec> policies =
        options.policies.empty() ? std::vector{options.tree.policy()} : options.policies;
    const RoundLines lines(policies, options.repeat);
    ShownRows shown(lines.header(),
                    !takes_stdout({options.json, options.csv, options.trace_events}), messages);
    const auto add_row = [&](int round, const PolicyRun& run) { shown.add(lines.row(round, run)); };
    std::optional<Progress> progress;
    std::uint64_t done = 0;
    for (const BackendChoice choice : choices) {
        std::unique_ptr<Backend> backend = make_backend(choice, options.backend, messages);
        const std::string name = backend->info().name;
        PolicyRunner runner(scene, frames, image_params(options, scene),
                            {.update = options.tree.update_config,
                             .build = build_config(options),
                             .build_at = options.tree.build_at},
                            options.repeat, std::move(backend));
        const std::size_t expected = runner.expected_frames(policies.size());
        if (!progress)
            progress.emplace("measuring", "image", expected * choices.size(),
                             progress_mode(options));
        const auto begin_frame = [&] {
            throw_if_interrupted();
            progress->update(done++);
            progress->begin(name, StepPart::kShown);
        };
        report.backends.push_back(runner.compare(policies, begin_frame, add_row));
    }
    progress->finish();
    if (!options.plot.empty())
        report.scaling = measure_scaling(options, choices, report.head.triangles, messages);
    publish(report, options, shown, messages);
    return ExitCode::kOk;
}

}  // namespace mray::app
