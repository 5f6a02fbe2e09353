#include "app/commands/profile/stage_profiler.h"

#include <algorithm>

#include "app/clip/frames.h"
#include "common/base/stopwatch.h"
#include "common/bvh/bvh_stats.h"
#include "tools/measure/median.h"

namespace mray::app {
namespace {

/// Before each stage.
constexpr int kYardstickRuns = 3;

}  // namespace

StageProfiler::StageProfiler(const Options& options, SceneFrames& scene, double first_frame,
                             BackendChoice choice, Yardstick& yardstick, const Messages& messages)
    : options_(options),
      scene_(scene),
      yardstick_(yardstick),
      params_(image_params(options, scene)),
      refits_(make_backend(choice, options.backend, messages)),
      given_(make_backend(choice, options.backend, messages)) {
    const double build_at = options.tree.build_at.value_or(first_frame);
    const std::span<const vec3> positions = scene.positions(build_at);
    tree_ = build(positions);
    refits_->set_scene(scene.clip().topology(), positions, tree_);
    given_->set_scene(scene.clip().topology(), positions, tree_);
}

ProfileRow StageProfiler::measure(double frame) {
    ProfileRow row;
    row.frame = frame;
    row.backend = backend();
    yardstick_ms_.clear();
    std::span<const vec3> positions;
    row.times.deform_ms = median(run([&] {
        positions = scene_.positions(frame);
        return scene_.deform_ms();
    }));
    UpdateTimes& update = row.times.update;
    std::vector<double> uploads;
    std::vector<double> updates;
    update.refit_ms = median(run([&] {
        refits_->refit(positions, RefitExtent::kAll);
        const UpdateTimes times = refits_->finish().update;
        uploads.push_back(times.upload_ms);
        updates.push_back(times.upload_ms + times.refit_ms);
        return times.refit_ms;
    }));
    update.upload_ms = median(uploads);
    row.least_update_ms = std::ranges::min(updates);
    refits_->read_tree(tree_);
    row.sah_cost = bvh_stats(tree_).sah_cost;
    Bvh rebuilt;
    const std::vector<double> rebuilds = run([&] {
        const Stopwatch watch;
        rebuilt = build(positions);
        return watch.ms();
    });
    update.rebuild_ms = median(rebuilds);
    row.least_rebuild_ms = std::ranges::min(rebuilds);
    row.rebuilt_sah_cost = bvh_stats(rebuilt).sah_cost;
    const std::vector<double> traces = trace(*refits_);
    row.times.trace_ms = median(traces);
    row.least_trace_ms = std::ranges::min(traces);
    row.times.rays = refits_->finish().rays;
    given_->set_frame(positions, rebuilt);
    const std::vector<double> traces_rebuilt = trace(*given_);
    row.trace_rebuilt_ms = median(traces_rebuilt);
    row.least_trace_rebuilt_ms = std::ranges::min(traces_rebuilt);
    row.yardstick_ms = std::ranges::min(yardstick_ms_);
    return row;
}

Bvh StageProfiler::build(std::span<const vec3> positions) const {
    return build_bvh(scene_.clip().topology(), positions,
                     {.split = options_.tree.split, .threads = options_.backend.threads});
}

/// The times of the runs of a stage, after the yardstick and one run to warm up, which also brings
/// back what the yardstick took from the caches.
std::vector<double> StageProfiler::run(const std::function<double()>& stage_ms) {
    for (int i = 0; i < kYardstickRuns; ++i) yardstick_ms_.push_back(yardstick_.run_ms());
    stage_ms();
    std::vector<double> times;
    for (int i = 0; i < options_.repeat; ++i) times.push_back(stage_ms());
    return times;
}

std::vector<double> StageProfiler::trace(Backend& backend) {
    return run([&] {
        backend.trace_image(params_, frame_);
        return backend.finish().trace_ms;
    });
}

}  // namespace mray::app
