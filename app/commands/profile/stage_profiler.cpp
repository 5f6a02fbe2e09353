#include "app/commands/profile/stage_profiler.h"

#include "app/clip/frames.h"
#include "common/base/stopwatch.h"
#include "common/bvh/bvh_stats.h"
#include "common/report/median.h"

namespace mray::app {
namespace {

/// The caches are a small part of the time of a stage that takes longer.
constexpr double kLongMs = 50;

}  // namespace

StageProfiler::StageProfiler(const Options& options, SceneFrames& scene, double first_frame,
                             BackendChoice choice, const Messages& messages)
    : options_(options),
      scene_(scene),
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
    StageSamples& samples = row.samples;
    std::span<const vec3> positions;
    Bvh rebuilt;
    for (int round = 0; round < options_.repeat; ++round) {
        const auto add = [&](std::vector<double>& times, const std::function<double()>& stage_ms) {
            times.push_back(run(stage_ms, round == 0));
        };
        add(samples.deform, [&] {
            positions = scene_.positions(frame);
            return scene_.deform_ms();
        });
        UpdateTimes update;
        add(samples.update, [&] {
            refits_->refit(positions, RefitExtent::kAll);
            update = refits_->finish().update;
            return update.upload_ms + update.refit_ms;
        });
        samples.upload.push_back(update.upload_ms);
        samples.refit.push_back(update.refit_ms);
        add(samples.rebuild, [&] {
            const Stopwatch watch;
            rebuilt = build(positions);
            return watch.ms();
        });
        add(samples.trace, [&] { return trace(*refits_); });
        row.times.rays = refits_->finish().rays;
        if (round == 0) given_->set_frame(positions, rebuilt);
        add(samples.trace_rebuilt, [&] { return trace(*given_); });
    }
    row.times.deform_ms = median(samples.deform);
    row.times.update.upload_ms = median(samples.upload);
    row.times.update.refit_ms = median(samples.refit);
    row.times.update.rebuild_ms = median(samples.rebuild);
    row.times.trace_ms = median(samples.trace);
    row.trace_rebuilt_ms = median(samples.trace_rebuilt);
    refits_->read_tree(tree_);
    row.sah_cost = bvh_stats(tree_).sah_cost;
    row.rebuilt_sah_cost = bvh_stats(rebuilt).sah_cost;
    return row;
}

Bvh StageProfiler::build(std::span<const vec3> positions) const {
    return build_bvh(scene_.clip().topology(), positions,
                     {.split = options_.tree.split, .threads = options_.backend.threads});
}

/// Returns the time of a run of a stage. A run to warm up comes before it in the first round. Short
/// stages have one in all rounds, because other stages have emptied the caches.
double StageProfiler::run(const std::function<double()>& stage_ms, bool is_first_round) {
    const double first = stage_ms();
    return is_first_round || first < kLongMs ? stage_ms() : first;
}

double StageProfiler::trace(Backend& backend) {
    backend.trace_image(image_params(options_, scene_), frame_);
    return backend.finish().trace_ms;
}

}  // namespace mray::app
