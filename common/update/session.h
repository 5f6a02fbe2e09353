// A clip on a backend: from one frame to the next.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "common/backend.h"
#include "common/scene/scene_frames.h"
#include "common/update/tree_updater.h"

namespace morphray {

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

/// How a session builds its tree and keeps it up to date.
struct SessionConfig {
    /// An update policy in the form that make_update_policy() takes.
    std::string update = "refit";
    UpdateConfig update_config;
    SplitMethod split = SplitMethod::kBinned;
    /// CPU threads of builds; 0: as many as the machine has.
    int threads = 0;
    /// The frame at whose positions the tree is built; none: the first frame.
    std::optional<double> build_at;
};

/// Returns the config with the first_exponent that suits the tracer. Returns it unchanged if it is
/// deterministic: decisions must then be the same for all tracers.
UpdateConfig for_tracer(UpdateConfig config, const Backend& tracer);

/// Holds the tree and the backend that traces it, and keeps both at the current frame.
class Session {
public:
    /// Builds the tree at config.build_at (or at `first_frame`) and hands it to the tracer.
    /// `refitter` is the backend that refits; null: the tracer does. Throws what clip, builder and
    /// backends throw.
    Session(SceneFrames& frames, const SessionConfig& config, double first_frame,
            std::unique_ptr<Backend> tracer, std::unique_ptr<Backend> refitter);

    /// Deforms, and updates the tree as config.update says. Nothing to do at first for the frame
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

}  // namespace morphray
