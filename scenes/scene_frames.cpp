#include "scenes/scene_frames.h"

#include <utility>

#include "common/base/stopwatch.h"

namespace mray {

SceneFrames::SceneFrames(std::unique_ptr<Clip> clip)
    : clip_(std::move(clip)), space_(clip_->bounds()), scene_(clip_->topology().vertex_count) {}

std::span<const vec3> SceneFrames::positions(double frame) {
    const Stopwatch watch;
    clip_->positions(frame, scene_);
    space_ = space_of_frame(clip_->bounds(), bounds_of(scene_));
    space_.to_scene(scene_, scene_);
    deform_ms_ = watch.ms();
    return scene_;
}

}  // namespace mray
