// A clip with its scene space, and the positions of one of its frames at a time.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "common/scene/clip.h"
#include "common/scene/pose.h"
#include "common/scene/scene_keyframes.h"
#include "common/scene/scene_space.h"

namespace morphray {

/// A clip and the vertex positions of one of its frames at a time.
class SceneFrames {
public:
    explicit SceneFrames(std::unique_ptr<Clip> clip);

    const Clip& clip() const { return *clip_; }
    const SceneSpace& space() const { return space_; }

    /// Positions of a frame in scene space, valid until the next call. Throws Error(kBadInput).
    std::span<const vec3> positions(double frame);
    /// The frame without its positions, where keyframes will do; they are made when they are asked
    /// for, once, and before the next call. Throws Error(kBadInput).
    Pose pose(double frame);
    /// What making positions has taken since pose() was called.
    double deform_ms() const { return deform_ms_; }

private:
    std::unique_ptr<Clip> clip_;
    SceneSpace space_;
    SceneKeyframes keyframes_;
    double deform_ms_ = 0;
    std::vector<vec3> scene_;
};

}  // namespace morphray
