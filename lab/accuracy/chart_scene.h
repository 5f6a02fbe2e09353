// The scenes of charts, and their rays.
#pragma once

#include "common/bvh/bvh.h"
#include "common/scene/scene_space.h"
#include "lab/methods/peer_tree.h"
#include "lab/methods/tracers.h"

namespace mray::lab {

/// Positions and a tree around them.
struct ChartSpace {
    std::vector<vec3> positions;
    PeerTree tree;
};

/// A scene in world space: its middle frame, and some frames from its first on if it moves.
struct ChartInput {
    std::string name;
    Topology topology;
    std::vector<vec3> positions;
    std::vector<double> frame_numbers = {};
    std::vector<std::vector<vec3>> frames = {};
};

/// The program's methods trace scene space, all others world space. The mesh, the rays and the
/// nodes are the same in both.
struct ChartScene {
    Topology topology;
    /// Triangles whose vertices are all finite and not left out.
    std::vector<uvec3> targets;
    WorldBounds bounds;
    SceneSpace space{WorldBounds{}};
    ChartSpace scene_space;
    ChartSpace world_space;
    /// Of the program, in scene space.
    Bvh bvh;
};

/// The bounds of a frame without vertices that are left out (PoseExtent).
WorldBounds chart_bounds(const Topology& topology, std::span<const vec3> positions);
/// A frame of an animation with these bounds. Throws what the builder throws.
ChartScene make_chart_scene(const Topology& topology, std::span<const vec3> positions,
                            const WorldBounds& bounds);
/// The middle frame.
ChartScene make_chart_scene(const ChartInput& input);

/// Field of view in degrees, narrow enough for most pixels to show the scene.
inline constexpr double kChartFov = 20;

/// Some rays of a kind, in scene space, about `count` (rounded to tiles of 64 x 64). Each `chunk`
/// has others:
///   kPrimary  the pixels of a camera, from an eye of its own around the scene
///   kAimed    tiles of such pixels from near, far, inside and outside, each turned to the nearest
///             vertex or edge if that is within 0.4 pixels
///   kShadow   from the light to what the camera sees
///   kDiffuse  in any order: at vertices, points of edges and of faces, from anywhere; one in eight
///             along an axis
/// None for a scene without a target. Throws what the camera throws.
RaySet make_chart_rays(const ChartScene& scene, RayKind kind, std::size_t chunk, std::size_t count);

/// Moves rays to world space, exactly.
RaySet to_world(RaySet rays, const SceneSpace& space);

/// Small scenes on which intersection rules fail (docs/guide/accuracy.md says how).
std::vector<ChartInput> failure_scenes();

}  // namespace mray::lab
