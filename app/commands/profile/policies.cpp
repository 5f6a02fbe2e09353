#include "app/commands/profile/parts.h"

#include <fmt/format.h>

#include <memory>
#include <optional>
#include <utility>

#include "app/backends/backends.h"
#include "app/clip/frames.h"
#include "app/terminal/failure.h"
#include "app/terminal/progress.h"
#include "common/base/errors.h"
#include "common/base/output_file.h"
#include "common/report/plot.h"
#include "common/report/spread.h"
#include "common/report/table.h"
#include "common/text/number_text.h"
#include "scenes/inside_view.h"
#include "scenes/policy_runs.h"

namespace mray::app {
namespace {

/// A clip under several policies on each backend.
struct PolicyReport {
    ReportHead head;
    std::string rays;
    int repeat = 0;
    std::vector<PolicyComparison> backends;
};

/// Least, median and spread of the rounds.
Json of(const Spread& spread) {
    return {{"least_ms", spread.least},
            {"median_ms", spread.median},
            {"spread_percent", spread.percent}};
}

Json of(const PolicyRun& run) {
    Json hashes = Json::array();
    for (const PolicyFrame& frame : run.frames) hashes.push_back(hash_text(frame.hits_hash));
    return {{"policy", run.policy},
            {"backend", run.backend},
            {"total_ms", run.total_ms()},
            {"median_frame_ms", run.median_frame_ms()},
            {"worst_frame_ms", run.worst_frame_ms()},
            {"worst_trace_vs_rebuilt", run.worst_trace_vs_rebuilt()},
            {"regret", run.regret()},
            {"rebuilds", run.rebuilds()},
            {"total", of(spread_of(run.totals_ms))},
            {"hits_hashes", hashes}};
}

std::string to_json(const PolicyReport& report) {
    Json json = head_of(report.head);
    json["rays"] = report.rays;
    json["repeat"] = report.repeat;
    json["policies"] = Json::array();
    json["best_schedules"] = Json::array();
    for (const PolicyComparison& comparison : report.backends) {
        for (const PolicyRun& run : comparison.runs) json["policies"].push_back(of(run));
        Json rebuilt = Json::array();
        for (const std::size_t index : comparison.best.rebuilds)
            rebuilt.push_back(comparison.runs.front().frames[index].frame);
        const std::string best = comparison.best_policy();
        json["best_schedules"].push_back({{"backend", comparison.runs.front().backend},
                                          {"total_ms", comparison.best.total},
                                          {"rebuilt_at", rebuilt},
                                          {"regret_against", best.empty() ? "best schedule" : best},
                                          {"regret_against_ms", comparison.runs.front().best_ms}});
    }
    return json_text(json);
}

std::string ms(double value) { return fmt::format("{:.2f}", value); }

std::string in_percent(double part) { return fmt::format("{:.1f}", 100 * part); }

/// Returns a table with a row for each policy and backend and one for the best schedule of each
/// backend. A line below says which total the regret of a backend is compared with.
std::string text_of(const PolicyReport& report) {
    Table table({"policy", "backend", "total", "spread", "median", "worst", "slower", "regret",
                 "rebuilds"});
    std::string regrets;
    for (const PolicyComparison& comparison : report.backends) {
        for (const PolicyRun& run : comparison.runs) {
            table.add({run.policy, run.backend, ms(run.total_ms()),
                       fmt::format("{:.1f}", spread_of(run.totals_ms).percent),
                       ms(run.median_frame_ms()), ms(run.worst_frame_ms()),
                       fmt::format("{:.2f}", run.worst_trace_vs_rebuilt()),
                       in_percent(run.regret()), fmt::format("{}", run.rebuilds())});
        }
        const PolicyRun& first = comparison.runs.front();
        table.add({"(best schedule)", first.backend, ms(comparison.best.total), "", "", "", "",
                   in_percent(comparison.best.total / first.best_ms - 1),
                   fmt::format("{}", comparison.best.rebuilds.size())});
        const std::string best = comparison.best_policy();
        regrets += fmt::format(
            "regret on {}: beyond {} ms, {}\n", first.backend, ms(first.best_ms),
            best.empty() ? "the best schedule of refits and rebuilds" : "the total of " + best);
    }
    return fmt::format(
        "times in ms of {} round{}; total: the medians of its frames; median, worst: of a\n"
        "frame; spread: of the totals of rounds, in %; regret in %; slower: how many times\n"
        "as long the worst trace takes as over a new tree\n{}{}",
        report.repeat, report.repeat == 1 ? "" : "s", table.text(), regrets);
}

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

void publish(const PolicyReport& report, const ProfileOptions& options, const Messages& messages) {
    if (!options.json.empty()) write_report(options.json, to_json(report));
    if (!options.csv.empty()) write_report(options.csv, policy_frames_table(report.backends).csv());
    if (!options.plot.empty()) plot_policies(report, options.plot);
    if (!takes_stdout({options.json, options.csv})) messages.print(text_of(report));
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
    std::optional<Progress> progress;
    std::uint64_t done = 0;
    for (const BackendChoice choice : choices) {
        std::unique_ptr<Backend> backend = make_backend(choice, options.backend, messages);
        const std::string name = backend->info().name;
        PolicyRunner runner(scene, frames, with_inside_view(options.view, scene.clip()),
                            {.update = {},
                             .build = build_config(options.tree.split, options.backend),
                             .build_at = options.tree.build_at},
                            *options.repeat, std::move(backend));
        const std::size_t expected = runner.expected_frames(options.policies.size());
        if (!progress) progress.emplace("measuring", expected * choices.size(), messages);
        const auto begin_frame = [&] {
            throw_if_interrupted();
            progress->update(done++);
            progress->begin(name);
        };
        report.backends.push_back(runner.compare(options.policies, begin_frame));
    }
    progress.reset();
    publish(report, options, messages);
    return ExitCode::kOk;
}

}  // namespace mray::app
