#include "app/session.h"

#include <utility>

#include "app/backends.h"
#include "app/stopwatch.h"

namespace morphray::app {

Session::Session(SceneFrames& frames, const TreeOptions& options, int threads, double first_frame,
                 std::unique_ptr<Backend> tracer, std::unique_ptr<Backend> refitter)
    : frames_(frames),
      options_(options),
      threads_(threads),
      tracer_(std::move(tracer)),
      refitter_(std::move(refitter)),
      current_(options.build_at.value_or(first_frame)) {
    const Stopwatch deform;
    const std::span<const vec3> positions = frames_.positions(current_);
    times_.deform_ms = deform.ms();
    bvh_ = build(positions);
    const Topology& topology = frames_.clip().topology();
    tracer_->set_scene(topology, positions, bvh_);
    times_.upload_ms = tracer_->times().upload_ms;
    if (refitter_ != nullptr) refitter_->set_scene(topology, positions, bvh_);
}

Bvh Session::build(std::span<const vec3> positions) {
    const Stopwatch watch;
    Bvh bvh = build_bvh(frames_.clip().topology(), positions,
                        {.split = options_.split, .threads = threads_});
    times_.rebuild_ms = watch.ms();
    return bvh;
}

void Session::advance(double frame) {
    if (std::exchange(fresh_, false) && frame == current_) return;
    times_ = {};
    current_ = frame;
    const Stopwatch deform;
    const std::span<const vec3> positions = frames_.positions(frame);
    times_.deform_ms = deform.ms();
    if (options_.update == Update::kRebuild) {
        bvh_ = build(positions);
        tracer_->set_frame(positions, bvh_);
        times_.upload_ms = tracer_->times().upload_ms;
        last_step_ = TreeStep::kRebuilt;
        return;
    }
    Backend& refitter = refitter_ != nullptr ? *refitter_ : *tracer_;
    refitter.refit(positions);
    times_.refit_ms = refitter.times().refit_ms;
    times_.upload_ms = refitter.times().upload_ms;
    last_step_ = TreeStep::kRefitted;
    if (refitter_ == nullptr) return;
    const Stopwatch upload;
    refitter_->read_bvh(bvh_);
    tracer_->set_frame(positions, bvh_);
    times_.upload_ms += upload.ms();
}

void Session::trace(const ImageParams& params, Frame& frame) {
    tracer_->trace_image(params, frame);
    times_.trace_ms = tracer_->times().trace_ms;
    times_.rays = tracer_->times().rays;
}

const Bvh& Session::tree() {
    tracer_->read_bvh(bvh_);
    return bvh_;
}

std::string Session::refitted_on() const {
    if (last_step_ != TreeStep::kRefitted) return {};
    const std::string& name = (refitter_ != nullptr ? refitter_ : tracer_)->name();
    return name == "brute" ? "cpu" : name;
}

Session open_session(const Options& options, SceneFrames& frames, double first_frame,
                     const Messages& messages) {
    std::unique_ptr<Backend> tracer = make_backend(options.backend, messages);
    std::unique_ptr<Backend> refitter;
    const bool traces_on_vulkan = tracer->name() == "vulkan";
    if (options.tree.update == Update::kRefit) {
        if (options.tree.refit_on == RefitOn::kVulkan && !traces_on_vulkan) {
            refitter = make_backend(BackendChoice::kVulkan, options.backend, messages);
        }
        if (options.tree.refit_on == RefitOn::kCpu && traces_on_vulkan) {
            refitter = make_backend(BackendChoice::kCpu, options.backend, messages);
        }
    }
    messages.note("tracing on " + tracer->name() + ": " + tracer->description());
    return Session(frames, options.tree, options.backend.threads, first_frame, std::move(tracer),
                   std::move(refitter));
}

}  // namespace morphray::app
