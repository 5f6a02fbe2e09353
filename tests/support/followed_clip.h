// A clip on one backend, frame by frame.
#pragma once

#include <memory>
#include <utility>

#include "common/backend.h"
#include "common/update/tree_updater.h"
#include "scenes/scene_frames.h"
#include "tests/support/last_trace.h"

namespace mray::test {

/// Keeps a tree at the current frame. `frames` must outlive it.
class FollowedClip {
public:
    /// Builds the tree at `first_frame`.
    FollowedClip(SceneFrames& frames, double first_frame, const PolicySpec& policy,
                 const UpdateConfig& config, int threads, std::unique_ptr<Backend> tracer)
        : frames_(frames),
          tracer_(std::move(tracer)),
          updater_(frames.clip().topology(), frames.positions(first_frame), *tracer_, nullptr,
                   policy, {.threads = threads}, config),
          current_(first_frame) {}

    /// Does nothing if the first call is for the frame of the build.
    void advance(double frame) {
        if (std::exchange(is_fresh_, false) && frame == current_) return;
        updater_.update(frames_.positions(frame));
    }
    void trace(const ImageParams& params, Frame& frame) {
        tracer_->trace_image(params, frame);
        updater_.frame_done(last_trace(*tracer_));
    }

    const TreeUpdate& last_update() const { return updater_.last(); }
    const Bvh& tree() { return updater_.tree(); }

private:
    SceneFrames& frames_;
    std::unique_ptr<Backend> tracer_;
    TreeUpdater updater_;
    double current_;
    bool is_fresh_ = true;
};

}  // namespace mray::test
