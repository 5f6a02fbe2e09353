// An animation with its scene space and view, and the positions of one of its frames at a time.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "common/frame_times.h"
#include "common/interop/constants.h"
#include "common/scene/camera_setup.h"
#include "common/scene/scene_space.h"
#include "common/text/text_parts.h"
#include "scenes/animation.h"

namespace mray {

/// Says that vertices are left out since they are too far (PoseExtent::limit()).
inline Warning warning_of_far(const Animation& animation, std::uint64_t vertices) {
    return {
        escape(animation.name()),
        fmt::format("{} of {} vertices are left out with their triangles: more than 2^{} times as "
                    "far from the origin as most",
                    vertices, animation.topology().vertex_count, kFarExponent)};
}

/// The vertices of the first frame that are not left out, in world space.
inline std::vector<vec3> first_vertices(const Animation& animation) {
    const Topology& topology = animation.topology();
    std::vector<vec3> all(topology.vertex_count);
    animation.positions(animation.first_frame(), all);
    std::vector<vec3> kept;
    const std::vector<IndexRange> used = used_vertices(topology);
    const SceneSpace space = space_of_pose(animation.bounds(), PoseExtent(all, used));
    for (const IndexRange& range : used)
        std::copy_if(&all[range.begin], all.data() + range.end, std::back_inserter(kept),
                     [&](const vec3& p) { return space.keeps(p); });
    return kept;
}

/// A view in the file's coordinates as one in world space: from the animation's inside_view() if
/// there is one, else from frame_object(), unless eye or target are given. Throws Error(kBadInput).
inline ViewSpec world_view(ViewSpec view, const Animation& animation) {
    for (std::optional<Point>* const point : {&view.eye, &view.target, &view.light})
        if (*point) *point = to_point(to_dvec3(**point) - animation.origin().at);
    const bool is_free = !view.eye && !view.target;
    if (is_free && !animation.is_builtin()) return frame_object(view, first_vertices(animation));
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
    /// `warn` is told once of vertices that are too far.
    explicit SceneFrames(std::unique_ptr<Animation> animation, WarnFunction warn = {})
        : animation_(std::move(animation)),
          warn_(std::move(warn)),
          used_(used_vertices(animation_->topology())),
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
        const PoseExtent pose(positions_, used_);
        space_ = space_of_pose(animation_->bounds(), pose);
        const std::uint64_t far = pose.count_beyond(space_.limit());
        if (far > 0 && warn_) std::exchange(warn_, {})(warning_of_far(*animation_, far));
        space_.to_scene(positions_, positions_);
        auto unused = positions_.begin();
        for (const IndexRange& range : used_) {
            std::fill(unused, positions_.begin() + range.begin, vec3(kInvalidCoordinate));
            unused = positions_.begin() + range.end;
        }
        std::fill(unused, positions_.end(), vec3(kInvalidCoordinate));
        deform_ms_ = watch.ms();
        return positions_;
    }
    double deform_ms() const { return deform_ms_; }

private:
    std::unique_ptr<Animation> animation_;
    WarnFunction warn_;
    std::vector<IndexRange> used_;
    SceneSpace space_;
    double deform_ms_ = 0;
    std::vector<vec3> positions_;
    WorldViews views_;
};

}  // namespace mray
