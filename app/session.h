// A clip on a backend: from one frame to the next.
#pragma once

#include <memory>

#include "app/options.h"
#include "app/scene_frames.h"
#include "common/backend.h"
#include "common/tree_updater.h"

namespace morphray::app {

/// Milliseconds of the parts of the last step; those that did not happen are 0.
struct StepTimes {
    double deform_ms = 0;  // the clip's positions, in scene space
    double upload_ms = 0;  // to the backend, and a tree between backends
    double refit_ms = 0;
    double decide_ms = 0;  // whether the tree will do
    double restructure_ms = 0;
    double rebuild_ms = 0;
    double trace_ms = 0;
    std::uint64_t rays = 0;

    double update_ms() const {
        return upload_ms + refit_ms + decide_ms + restructure_ms + rebuild_ms;
    }
    double total_ms() const { return deform_ms + update_ms() + trace_ms; }
};

/// Holds the tree and the backend that traces it, and keeps both at the current frame.
class Session {
public:
    /// Builds the tree at options.build_at (or at `first_frame`) and hands it to the tracer.
    /// `refitter` is the backend that refits; null: the tracer does. Throws what clip, builder and
    /// backends throw.
    Session(SceneFrames& frames, const TreeOptions& options, int threads, double first_frame,
            std::unique_ptr<Backend> tracer, std::unique_ptr<Backend> refitter);

    /// Deforms, and updates the tree as options.update says. Nothing to do at first for the frame
    /// of the build.
    void advance(double frame);
    void trace(const ImageParams& params, Frame& frame);

    Backend& tracer() { return *tracer_; }
    /// The tree at the current frame, read back from the tracer.
    const Bvh& tree() { return updater_->tree(); }

    const StepTimes& times() const { return times_; }
    const TreeUpdate& last_update() const { return updater_->last(); }
    /// "cpu" or "vulkan" after a refit, otherwise empty.
    std::string refitted_on() const;

private:
    void take_times();

    SceneFrames& frames_;
    std::unique_ptr<Backend> tracer_;
    std::unique_ptr<Backend> refitter_;
    std::unique_ptr<TreeUpdater> updater_;
    double current_ = 0;
    bool fresh_ = true;
    StepTimes times_;
};

/// The session that the options ask for: resolves the backends and builds at the first frame.
Session open_session(const Options& options, SceneFrames& frames, double first_frame,
                     const Messages& messages);

}  // namespace morphray::app
