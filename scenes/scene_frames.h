// An animation with its scene space and view, and the positions of one of its frames at a time.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "common/frame_times.h"
#include "common/scene/camera_setup.h"
#include "common/scene/scene_space.h"
#include "scenes/animation.h"

namespace mray {

/// A view in the file's coordinates as one in world space: from the animation's inside_view() if
/// there is one, else from frame_object(), unless eye or target are given. Throws Error(kBadInput).
inline ViewSpec world_view(ViewSpec view, const Animation& animation) {
    for (std::optional<Point>* const point : {&view.eye, &view.target, &view.light})
        if (*point) *point = to_point(to_dvec3(**point) - animation.origin().at);
    const bool is_free = !view.eye && !view.target;
    if (is_free && !animation.is_builtin()) {
        std::vector<vec3> first(animation.topology().vertex_count);
        animation.positions(animation.first_frame(), first);
        return frame_object(view, first);
    }
    const std::optional<InsideView> inside = animation.inside_view();
    if (!inside) return view;
    if (is_free) {
        view.eye = inside->eye;
        view.target = inside->target;
    }
    if (!view.light) view.light = inside->light;
    return view;
}

/// Views of an animation, of which the last one is kept.
class WorldViews {
public:
    const ViewSpec& of(const ViewSpec& view, const Animation& animation) {
        if (!world_ || given_ != view) world_ = world_view(given_ = view, animation);
        return *world_;
    }

private:
    ViewSpec given_;
    std::optional<ViewSpec> world_;
};

class SceneFrames {
public:
    explicit SceneFrames(std::unique_ptr<Animation> animation)
        : animation_(std::move(animation)),
          space_(animation_->bounds()),
          positions_(animation_->topology().vertex_count) {}

    const Animation& animation() const { return *animation_; }
    /// The space of the frame of the last call of positions().
    const SceneSpace& space() const { return space_; }
    /// The parameters of an image of that frame: world_view(), make_image_params().
    ImageParams image_params(const ViewSpec& view) {
        return make_image_params(views_.of(view, *animation_), animation_->bounds(), space_);
    }

    /// In the scene space of that frame. Valid until the next call. Throws Error(kBadInput).
    std::span<const vec3> positions(double frame) {
        const Stopwatch watch;
        animation_->positions(frame, positions_);
        space_ = space_of_frame(animation_->bounds(), bounds_of(positions_));
        space_.to_scene(positions_, positions_);
        deform_ms_ = watch.ms();
        return positions_;
    }
    double deform_ms() const { return deform_ms_; }

private:
    std::unique_ptr<Animation> animation_;
    SceneSpace space_;
    double deform_ms_ = 0;
    std::vector<vec3> positions_;
    WorldViews views_;
};

}  // namespace mray
