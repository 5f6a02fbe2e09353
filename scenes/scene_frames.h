// A clip with its scene space, and the positions of one of its frames at a time.
#pragma once

#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "common/base/stopwatch.h"
#include "common/scene/camera_setup.h"
#include "common/scene/scene_space.h"
#include "scenes/clip.h"

namespace mray {

class SceneFrames {
public:
    explicit SceneFrames(std::unique_ptr<Clip> clip)
        : clip_(std::move(clip)),
          space_(clip_->bounds()),
          positions_(clip_->topology().vertex_count) {}

    const Clip& clip() const { return *clip_; }
    /// The space of the frame of the last call of positions().
    const SceneSpace& space() const { return space_; }
    /// Returns make_image_params() for that frame.
    ImageParams image_params(const ViewSpec& view) const {
        return make_image_params(view, clip_->bounds(), space_);
    }

    /// Makes the positions of a frame, in the scene space of that frame. Valid until the next call.
    /// Throws Error(kBadInput).
    std::span<const vec3> positions(double frame) {
        const Stopwatch watch;
        clip_->positions(frame, positions_);
        space_ = space_of_frame(clip_->bounds(), bounds_of(positions_));
        space_.to_scene(positions_, positions_);
        deform_ms_ = watch.ms();
        return positions_;
    }
    /// Milliseconds that the last call of positions() took.
    double deform_ms() const { return deform_ms_; }

private:
    std::unique_ptr<Clip> clip_;
    SceneSpace space_;
    double deform_ms_ = 0;
    std::vector<vec3> positions_;
};

}  // namespace mray
