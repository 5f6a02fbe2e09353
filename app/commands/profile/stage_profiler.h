// Measures the stages of frames on one backend.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "app/backends/backends.h"
#include "app/report/profile_report.h"
#include "scenes/scene_frames.h"

namespace mray::app {

/// One instance of the backend refits a tree from the first frame on; a second one traces the tree
/// that is built for each frame. All stages of a frame are run in turn, as often as
/// Options::repeat says, so that what disturbs the machine for a while disturbs all of them.
class StageProfiler {
public:
    /// Builds the first tree. Options and scene must outlive it. Throws as make_backend.
    StageProfiler(const Options& options, SceneFrames& scene, double first_frame,
                  BackendChoice choice, const Messages& messages);

    std::string backend() const { return refits_->info().name; }

    /// Frames must come in the order of the clip.
    ProfileRow measure(double frame);

private:
    Bvh build(std::span<const vec3> positions) const;
    double run(const std::function<double()>& stage_ms, bool is_first_round);
    double trace(Backend& backend);

    const Options& options_;
    SceneFrames& scene_;
    std::unique_ptr<Backend> refits_;
    std::unique_ptr<Backend> given_;
    Bvh tree_;
    Frame frame_;
};

}  // namespace mray::app
