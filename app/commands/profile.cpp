// morphray profile: measures the stages of a frame.
#include <fmt/format.h>

#include <algorithm>
#include <functional>

#include "app/backends.h"
#include "app/commands/commands.h"
#include "app/commands/profile_head.h"
#include "app/commands/profile_policies.h"
#include "app/frames.h"
#include "app/memory_budget.h"
#include "app/report/report_json.h"
#include "app/report/reports.h"
#include "app/terminal/interrupt.h"
#include "app/terminal/progress.h"
#include "common/base/median.h"
#include "common/base/stopwatch.h"
#include "common/text/table.h"

namespace mray::app {
namespace {

/// The median time of `repeat` runs of a step, after one run to warm up.
double median_ms(int repeat, const std::function<double()>& run_ms) {
    run_ms();
    std::vector<double> times;
    for (int i = 0; i < repeat; ++i) times.push_back(run_ms());
    return median(times);
}

/// Measures one backend. One instance refits a tree from the first frame on; a second instance
/// traces the tree that is built for each frame.
class Profiler {
public:
    Profiler(const Options& options, SceneFrames& scene, double first_frame, BackendChoice choice,
             const Messages& messages)
        : options_(options),
          scene_(scene),
          params_(make_image_params(options.view, scene.clip().bounds(), scene.space())),
          refits_(make_backend(choice, options.backend, messages)),
          given_(make_backend(choice, options.backend, messages)) {
        const double build_at = options.tree.build_at.value_or(first_frame);
        const std::span<const vec3> positions = scene.positions(build_at);
        tree_ = build(positions);
        refits_->set_scene(scene.clip().topology(), positions, tree_);
        given_->set_scene(scene.clip().topology(), positions, tree_);
    }

    ProfileRow measure(double frame) {
        ProfileRow row;
        row.frame = frame;
        row.backend = refits_->name();
        std::span<const vec3> positions;
        row.times.deform_ms = median_ms(options_.repeat, [&] {
            positions = scene_.positions(frame);
            return scene_.deform_ms();
        });
        UpdateTimes& update = row.times.update;
        std::vector<double> uploads;
        update.refit_ms = median_ms(options_.repeat, [&] {
            refits_->refit(positions, RefitExtent::kAll);
            uploads.push_back(refits_->times().update.upload_ms);
            return refits_->times().update.refit_ms;
        });
        update.upload_ms = median(uploads);
        refits_->read_tree(tree_);
        row.sah_cost = bvh_stats(tree_).sah_cost;
        Bvh rebuilt;
        update.rebuild_ms = median_ms(options_.repeat, [&] {
            const Stopwatch watch;
            rebuilt = build(positions);
            return watch.ms();
        });
        row.rebuilt_sah_cost = bvh_stats(rebuilt).sah_cost;
        row.times.trace_ms = trace_ms(*refits_);
        row.times.rays = refits_->times().rays;
        given_->set_frame(positions, rebuilt);
        row.trace_rebuilt_ms = trace_ms(*given_);
        return row;
    }

private:
    Bvh build(std::span<const vec3> positions) const {
        return build_bvh(scene_.clip().topology(), positions,
                         {.split = options_.tree.split, .threads = options_.backend.threads});
    }

    double trace_ms(Backend& backend) {
        return median_ms(options_.repeat, [&] {
            backend.trace_image(params_, frame_);
            return backend.times().trace_ms;
        });
    }

    const Options& options_;
    SceneFrames& scene_;
    ImageParams params_;
    std::unique_ptr<Backend> refits_;
    std::unique_ptr<Backend> given_;
    Bvh tree_;
    Frame frame_;
};

Table table_of(const ProfileReport& report) {
    Table table({"frame", "backend", "deform ms", "upload ms", "refit ms", "refit ns/tri",
                 "rebuild ms", "rebuild ns/tri", "trace ms", "Mray/s", "SAH cost",
                 "rebuilt trace ms", "rebuilt Mray/s", "rebuilt SAH cost"});
    const auto triangles = static_cast<double>(std::max<std::uint64_t>(1, report.head.triangles));
    const auto number = [](double x) { return fmt::format("{:.3f}", x); };
    for (const ProfileRow& row : report.rows) {
        const FrameTimes& t = row.times;
        const auto rate = [&t](double ms) {
            return static_cast<double>(t.rays) / (ms * 1e3 + 1e-9);
        };
        table.add({fmt::format("{}", row.frame), row.backend, number(t.deform_ms),
                   number(t.update.upload_ms), number(t.update.refit_ms),
                   number(t.update.refit_ms * 1e6 / triangles), number(t.update.rebuild_ms),
                   number(t.update.rebuild_ms * 1e6 / triangles), number(t.trace_ms),
                   number(rate(t.trace_ms)), number(row.sah_cost), number(row.trace_rebuilt_ms),
                   number(rate(row.trace_rebuilt_ms)), number(row.rebuilt_sah_cost)});
    }
    return table;
}

void publish(const ProfileReport& report, const Options& options, const Messages& messages) {
    const Table table = table_of(report);
    if (!options.json.empty()) write_report(options.json, to_json(report));
    if (!options.csv.empty()) write_report(options.csv, table.csv());
    if (!takes_stdout({options.json, options.csv})) messages.print(table.text());
}

}  // namespace

ExitCode run_profile(const Options& options, const Messages& messages) {
    if (!options.policies.empty() || !options.tree.update.empty()) {
        return profile_policies(options, messages);
    }
    check_reports({options.json, options.csv});
    SceneFrames scene = open_frames(options, messages);
    const std::vector<double> frames = select_frames(options, scene.clip(), DefaultFrames::kFew);
    warn_of_damage(options, scene.clip(), frames, messages);
    ProfileReport report;
    report.head = profile_head(options, scene.clip());
    report.rays = name_of_rays(options.view.rays);
    report.repeat = options.repeat;
    const std::vector<BackendChoice> choices = profiled_backends(options, messages);
    Progress progress("measuring", frames.size() * choices.size(), progress_mode(options));
    for (const BackendChoice choice : choices) {
        Profiler profiler(options, scene, frames.front(), choice, messages);
        for (const double frame : frames) {
            throw_if_interrupted();
            report.rows.push_back(profiler.measure(frame));
            progress.update(report.rows.size());
        }
    }
    progress.finish();
    report.peak_memory_bytes = peak_memory_bytes();
    publish(report, options, messages);
    return ExitCode::kOk;
}

}  // namespace mray::app
