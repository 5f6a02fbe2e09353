#include "lab/bench/bench_scene.h"

#include <algorithm>
#include <cmath>

#include "common/bvh/builder/bvh_builder.h"
#include "scenes/scene_frames.h"

namespace mray::bench {
namespace {

std::vector<vec3> nudged(std::vector<vec3> positions) {
    for (vec3& p : positions) {
        for (int axis = 0; axis < 3; ++axis) p[axis] = std::nextafter(p[axis], 0.0f);
    }
    return positions;
}

/// The bounds of all whole frames, since a benchmark traces several of them from one camera.
WorldBounds bounds_of_frames(const Animation& animation) {
    WorldBounds all;
    std::vector<vec3> positions(animation.topology().vertex_count);
    for (double frame = animation.first_frame(); frame <= animation.last_frame(); ++frame) {
        animation.positions(frame, positions);
        all.extend(bounds_of(positions));
    }
    return all;
}

/// The field of view of views from inside, in degrees.
constexpr double kInsideFov = 70;

}  // namespace

std::vector<vec3> positions_at(const BenchScene& scene, double frame) {
    std::vector<vec3> positions(scene.topology().vertex_count);
    scene.animation->positions(frame, positions);
    scene.space.to_scene(positions, positions);
    return positions;
}

BenchScene open_bench_scene(const std::string& spec, const ViewSpec& view) {
    BenchScene scene;
    scene.name = spec;
    AnimationOptions lenient;
    lenient.lenient = true;
    scene.animation = open_scene(spec, lenient);
    const Animation& animation = *scene.animation;
    scene.space = space_of_frame(animation.bounds(), bounds_of_frames(animation));
    const double middle = std::floor((animation.first_frame() + animation.last_frame()) / 2);
    scene.positions = positions_at(scene, middle);
    scene.moved = animation.last_frame() > animation.first_frame()
                      ? positions_at(scene, std::min(middle + 1, animation.last_frame()))
                      : nudged(scene.positions);
    scene.bvh = build_bvh(animation.topology(), scene.positions);
    if (animation.inside_view()) {
        scene.view = world_view(view, animation);
        scene.view.fov = kInsideFov;
    } else {
        scene.view = fill_view(view, animation.bounds(), scene.space, scene.bvh);
    }
    scene.params = make_image_params(scene.view, animation.bounds(), scene.space);
    return scene;
}

}  // namespace mray::bench
