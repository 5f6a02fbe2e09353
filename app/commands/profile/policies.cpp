#include "app/commands/profile/parts.h"

#include <fmt/format.h>

#include <memory>
#include <optional>
#include <utility>

#include "app/backends/backends.h"
#include "app/clip/frames.h"
#include "app/report/policy_report.h"
#include "app/terminal/interrupt.h"
#include "app/terminal/progress.h"
#include "common/base/errors.h"
#include "common/base/output_file.h"
#include "common/report/plot.h"
#include "scenes/inside_view.h"
#include "scenes/policy_runs.h"

namespace mray::app {
namespace {

/// Draws the panels of policy_panels for each backend.
void plot_policies(const PolicyReport& report, const std::string& file) {
    const plot::Figure figure{
        .title = fmt::format("Update policies: {}, {} triangles", report.head.scene,
                             report.head.triangles),
        .footer = fmt::format("{}x{} pixels, {} rays; {}", report.head.width, report.head.height,
                              report.rays,
                              report.repeat == 1 ? std::string("one round")
                                                 : fmt::format("medians of {} rounds, with bars "
                                                               "from the least",
                                                               report.repeat)),
        .columns = 3,
        .panel_height = 420,
        .panels = policy_panels(report.backends, "frame")};
    write_file(file, plot::draw(figure, policy_frames_table(report.backends).csv(),
                                file.ends_with(".png") ? "png" : "svg"));
}

void require_plotter(const std::string& file) {
    if (!file.ends_with(".svg") && !file.ends_with(".png")) {
        throw Error(ErrorKind::kBadArgument,
                    fmt::format("--plot: {} ends neither in .svg nor in .png", file));
    }
    plot::require_gnuplot("--plot");
}

void publish(const PolicyReport& report, const ProfileOptions& options, const ShownRows& shown,
             const Messages& messages) {
    if (!options.json.empty()) write_report(options.json, to_json(report));
    if (!options.csv.empty()) write_report(options.csv, policy_frames_table(report.backends).csv());
    if (!options.plot.empty()) plot_policies(report, options.plot);
    shown.finish();
    if (!takes_stdout({options.json, options.csv})) messages.print("\n" + policy_text(report));
}

}  // namespace

ExitCode profile_policies(const ProfileOptions& options, const Messages& messages) {
    check_reports({options.json, options.csv, options.plot});
    if (!options.plot.empty()) require_plotter(options.plot);
    SceneFrames scene(open_clip(options.source, messages));
    const std::vector<double> frames =
        select_frames(options.frames, options.tree.build_at, scene.clip(), DefaultFrames::kAll);
    PolicyReport report;
    report.head = profile_head(options, scene.clip());
    report.rays = name_of_rays(options.view.rays);
    report.repeat = *options.repeat;
    const std::vector<BackendChoice> choices = profiled_backends(options.backend, messages);
    const RoundLines lines(options.policies, *options.repeat);
    ShownRows shown(lines.header(), !takes_stdout({options.json, options.csv}), messages);
    const auto add_row = [&](int round, const PolicyRun& run) { shown.add(lines.row(round, run)); };
    std::optional<Progress> progress;
    std::uint64_t done = 0;
    for (const BackendChoice choice : choices) {
        std::unique_ptr<Backend> backend = make_backend(choice, options.backend, messages);
        const std::string name = backend->info().name;
        PolicyRunner runner(scene, frames, with_inside_view(options.view, scene.clip()),
                            {.update = options.tree.update_config,
                             .build = build_config(options.tree.split, options.backend),
                             .build_at = options.tree.build_at},
                            *options.repeat, std::move(backend));
        const std::size_t expected = runner.expected_frames(options.policies.size());
        if (!progress) progress.emplace("measuring", expected * choices.size(), messages);
        const auto begin_frame = [&] {
            throw_if_interrupted();
            progress->update(done++);
            progress->begin(name, StepPart::kHidden);
        };
        report.backends.push_back(runner.compare(options.policies, begin_frame, add_row));
    }
    progress.reset();
    publish(report, options, shown, messages);
    return ExitCode::kOk;
}

}  // namespace mray::app
