// The positions of an animation in scene space, a frame at a time.
#pragma once

#include <algorithm>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "common/scene/camera_setup.h"
#include "common/scene/scene_space.h"
#include "scenes/animation.h"

namespace mray {

class SceneFrames {
public:
    explicit SceneFrames(std::unique_ptr<Animation> animation)
        : animation_(std::move(animation)),
          used_(used_vertices(animation_->topology())),
          space_(animation_->bounds()),
          positions_(animation_->topology().vertex_count) {}

    const Animation& animation() const { return *animation_; }
    /// The space of the frame of the last call of positions().
    const SceneSpace& space() const { return space_; }
    ImageParams image_params(const ViewSpec& view) const {
        return make_image_params(view, animation_->bounds(), space_);
    }

    /// In the scene space of that frame. Valid until the next call. Throws Error(kBadInput).
    std::span<const vec3> positions(double frame) {
        animation_->positions(frame, positions_);
        space_ = space_of_pose(animation_->bounds(), PoseExtent(positions_, used_));
        space_.to_scene(positions_, positions_);
        auto unused = positions_.begin();
        for (const IndexRange& range : used_) {
            std::fill(unused, positions_.begin() + range.begin, vec3(kInvalidCoordinate));
            unused = positions_.begin() + range.end;
        }
        std::fill(unused, positions_.end(), vec3(kInvalidCoordinate));
        return positions_;
    }

private:
    std::unique_ptr<Animation> animation_;
    std::vector<IndexRange> used_;
    SceneSpace space_;
    std::vector<vec3> positions_;
};

}  // namespace mray
