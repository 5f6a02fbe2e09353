// One clip on one backend, frame by frame.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "common/backend.h"
#include "common/scene/scene_frames.h"
#include "common/update/tree_updater.h"

namespace mray {

/// How a session builds and updates its tree.
struct SessionConfig {
    /// An update policy, as make_update_policy() takes it.
    std::string update = "refit";
    UpdateConfig update_config;
    SplitMethod split = SplitMethod::kBinned;
    /// CPU threads of builds; 0: all of the machine.
    int threads = 0;
    /// The frame whose positions the tree is built at; none: the first frame.
    std::optional<double> build_at;
};

/// Returns the config with the first_per_visit of this kind of tracer. A deterministic config stays
/// as it is, since its decisions must be the same for all tracers.
UpdateConfig for_tracer(UpdateConfig config, const Backend& tracer);

/// Holds the tree and the backend that traces it, and keeps both at the current frame.
class Session {
public:
    /// Builds the tree at config.build_at (or at `first_frame`) and hands it to the tracer.
    /// `refitter` is the backend that refits; null: the tracer refits. `frames` must outlive the
    /// session. Throws what clip, builder and backends throw.
    Session(SceneFrames& frames, const SessionConfig& config, double first_frame,
            std::unique_ptr<Backend> tracer, std::unique_ptr<Backend> refitter);

    /// Deforms the clip to a frame and updates the tree by the policy. Does nothing if the first
    /// call is for the frame of the build.
    void advance(double frame);
    void trace(const ImageParams& params, Frame& frame);

    Backend& tracer() { return *tracer_; }
    /// The tree at the current frame, read back from the tracer.
    const Bvh& tree() { return updater_->tree(); }

    /// The times of the last advance() and trace(); before the first advance(), those of the build.
    const FrameTimes& times() const { return times_; }
    const TreeUpdate& last_update() const { return updater_->last(); }
    /// The backend that refitted the tree of this frame, "cpu" or "vulkan"; empty after a build.
    std::string refitted_on() const;

private:
    SceneFrames& frames_;
    std::unique_ptr<Backend> tracer_;
    std::unique_ptr<Backend> refitter_;
    std::unique_ptr<TreeUpdater> updater_;
    double current_ = 0;
    bool fresh_ = true;
    FrameTimes times_;
};

}  // namespace mray
