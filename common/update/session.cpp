#include "common/update/session.h"

#include <fmt/format.h>

#include <utility>

#include "common/base/stopwatch.h"

namespace morphray {

UpdateConfig for_tracer(UpdateConfig config, const Backend& tracer) {
    // What bench/updates does best with. Packets of 32 x 32 camera rays had 0.08 (explode) to 0.26
    // (shuffle) on the CPU, those of 64 x 64 feel degradation less; a device's have 0.1 (orbits) to
    // 0.21 (gather), where trees are only refitted.
    constexpr double kOnCpu = 0.08;
    constexpr double kOnDevice = 0.2;
    if (!config.deterministic)
        config.first_exponent = tracer.name() == "vulkan" ? kOnDevice : kOnCpu;
    return config;
}

Session::Session(SceneFrames& frames, const SessionConfig& config, double first_frame,
                 std::unique_ptr<Backend> tracer, std::unique_ptr<Backend> refitter)
    : frames_(frames),
      tracer_(std::move(tracer)),
      refitter_(std::move(refitter)),
      current_(config.build_at.value_or(first_frame)) {
    const Stopwatch deform;
    const std::span<const vec3> positions = frames_.positions(current_);
    times_.deform_ms = deform.ms();
    updater_ = std::make_unique<TreeUpdater>(
        frames_.clip().topology(), positions, *tracer_, refitter_.get(),
        make_update_policy(config.update, for_tracer(config.update_config, *tracer_)),
        BuildConfig{.split = config.split, .threads = config.threads}, config.update_config);
    take_times();
}

void Session::take_times() {
    const TreeUpdate& update = updater_->last();
    times_.upload_ms = update.upload_ms;
    times_.refit_ms = update.refit_ms;
    times_.decide_ms = update.decide_ms;
    times_.restructure_ms = update.restructure_ms;
    times_.rebuild_ms = update.rebuild_ms;
}

void Session::advance(double frame) {
    if (std::exchange(fresh_, false) && frame == current_) return;
    times_ = {};
    current_ = frame;
    Pose pose = frames_.pose(frame);
    if (updater_->needs_positions()) pose.positions();
    updater_->update(pose);
    times_.deform_ms = frames_.deform_ms();
    take_times();
}

void Session::trace(const ImageParams& params, Frame& frame) {
    tracer_->trace_image(params, frame);
    times_.trace_ms = tracer_->times().trace_ms;
    times_.rays = tracer_->times().rays;
    updater_->frame_done();
    take_times();
}

std::string Session::refitted_on() const {
    const TreeStep step = last_update().step;
    if (step == TreeStep::kBuilt || step == TreeStep::kRebuilt) return {};
    const std::string& name = (refitter_ != nullptr ? refitter_ : tracer_)->name();
    return name == "brute" ? "cpu" : name;
}

}  // namespace morphray
