// The scenes of charts: one frame with its trees and rays.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/bvh/bvh.h"
#include "common/scene/mesh.h"
#include "lab/methods/tracers.h"

namespace mray::lab {

/// What a method traces: in scene space for the program's rule, in world space for others.
struct ChartSpace {
    std::vector<vec3> positions;
    Bvh bvh;
    RaySet camera;
    /// Rays at vertices, points of edges and of faces, from outside and inside the scene.
    RaySet aimed;
};

/// One frame of a scene, in world space.
struct ChartInput {
    std::string name;
    Topology topology;
    std::vector<vec3> positions;
};

/// Both spaces have the same rays, in the same order.
struct ChartScene {
    Topology topology;
    ChartSpace scene_space;
    ChartSpace world_space;
};

/// Field of view in degrees, narrow enough for most pixels to show the scene.
inline constexpr double kChartFov = 20;

/// Makes the scene of a frame: side x side pixels (a multiple of kTileSize) from the default view
/// with kChartFov, and `aimed` aimed rays. Throws what the builder and the camera throw.
ChartScene make_chart_scene(const ChartInput& input, std::uint32_t side, std::size_t aimed);

/// Small scenes on which intersection rules fail: a sphere, far from 0, tiny and huge; needles; a
/// fan of thin triangles; duplicate and coplanar triangles; details of 1 in an extent of 1e6.
std::vector<ChartInput> failure_scenes();

}  // namespace mray::lab
