// A scene with its rays, and the points of queries: everything that the works need.
#pragma once

#include "common/bvh/bvh.h"
#include "common/scene/camera_setup.h"
#include "common/scene/scene_space.h"
#include "lab/methods/tracers.h"
#include "scenes/animation.h"

namespace mray::lab {

/// The frame in the middle of an animation, in scene space, with a tree, and the frame after it to
/// refit to. For a single frame that is the same one with every coordinate one float nearer to 0.
struct BenchScene {
    std::string name;
    std::unique_ptr<Animation> animation;
    /// Holds all whole frames.
    SceneSpace space{WorldBounds{}};
    ImageParams params;
    std::vector<vec3> positions;
    std::vector<vec3> moved;
    Bvh bvh;
    /// The rays of the camera, and what they hit.
    RaySet primary;
    AlignedVector<Hit> hits;

    const Topology& topology() const { return animation->topology(); }
    RaySet rays(RayKind kind) const;
};

std::vector<vec3> positions_at(const BenchScene& scene, double frame);

/// A view counts as full from this share of hits on, because a silhouette leaves out some corner.
inline constexpr double kFullShare = 0.95;
/// Without it, a scene that is full nowhere, such as separate triangles, would show only a few.
inline constexpr std::uint32_t kMaxZoom = 8;

/// `whole` from the default eye and by the default light, at the largest square of the image that
/// is full, or else at the fullest. `bvh` decides which square that is.
ViewSpec fill_view(const ViewSpec& whole, const WorldBounds& bounds, const SceneSpace& space,
                   const Bvh& bvh);

/// In a closed scene from inside. The image is a square; or, with a distance, all of the scene from
/// so many times the default eye's, 1920 x 1088. Throws what open_scene throws.
BenchScene open_bench_scene(const std::string& spec, std::uint32_t size, double distance = 0);

/// Points in any order in the box of all finite vertices. The same on each call.
std::vector<vec3> points_in_box(const BenchScene& scene, std::size_t count);
/// Points up to 1 % of the box's longest side away from places spread over the triangles.
std::vector<vec3> points_near_surface(const BenchScene& scene, std::size_t count);

/// Rays without an end from points_in_box() in directions of all kinds, in any order.
std::vector<Ray> random_rays(const BenchScene& scene, std::size_t count);

}  // namespace mray::lab
