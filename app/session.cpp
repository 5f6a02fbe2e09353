#include "app/session.h"

#include <fmt/format.h>

#include <utility>

#include "app/backends.h"
#include "app/update_options.h"
#include "common/stopwatch.h"

namespace morphray::app {

Session::Session(SceneFrames& frames, const TreeOptions& options, int threads, double first_frame,
                 std::unique_ptr<Backend> tracer, std::unique_ptr<Backend> refitter)
    : frames_(frames),
      tracer_(std::move(tracer)),
      refitter_(std::move(refitter)),
      current_(options.build_at.value_or(first_frame)) {
    const Stopwatch deform;
    const std::span<const vec3> positions = frames_.positions(current_);
    times_.deform_ms = deform.ms();
    updater_ = std::make_unique<TreeUpdater>(
        frames_.clip().topology(), positions, *tracer_, refitter_.get(),
        make_update_policy(options.update, for_tracer(options.update_config, *tracer_)),
        BuildConfig{.split = options.split, .threads = threads}, options.update_config);
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

Session open_session(const Options& options, SceneFrames& frames, double first_frame,
                     const Messages& messages) {
    std::unique_ptr<Backend> tracer = make_backend(options.backend, messages);
    std::unique_ptr<Backend> refitter;
    const bool traces_on_vulkan = tracer->name() == "vulkan";
    if (options.tree.refit_on == RefitOn::kVulkan && !traces_on_vulkan) {
        refitter = make_backend(BackendChoice::kVulkan, options.backend, messages);
    }
    if (options.tree.refit_on == RefitOn::kCpu && traces_on_vulkan) {
        refitter = make_backend(BackendChoice::kCpu, options.backend, messages);
    }
    messages.note("tracing on " + tracer->name() + ": " + tracer->description());
    return Session(frames, options.tree, options.backend.threads, first_frame, std::move(tracer),
                   std::move(refitter));
}

}  // namespace morphray::app
