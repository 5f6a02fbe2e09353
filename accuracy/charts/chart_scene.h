// A scene made ready to be charted: one frame, moved and scaled, with its trees and its rays.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/bvh/bvh.h"
#include "common/interop/params.h"
#include "common/interop/ray.h"
#include "common/scene/camera_setup.h"
#include "common/scene/mesh.h"
#include "common/scene/scene_space.h"

namespace morphray::accuracy {

/// Camera rays that are traced at a time: tiles of so many pixels a side.
inline constexpr std::uint32_t kChartTileSide = 64;
inline constexpr std::size_t kChartTile = std::size_t{kChartTileSide} * kChartTileSide;

/// What a method traces: the same mesh, tree and rays in scene space, where our rule works, or
/// in world space, where everybody else's does.
struct ChartSpace {
    std::vector<vec3> positions;
    Bvh bvh;
    /// The camera's, tile by tile.
    std::vector<Ray> camera_rays;
    /// At vertices, at points of edges, and between, from around the scene and from inside.
    std::vector<Ray> aimed_rays;
};

/// Of the scene's size: where it is moved to along (1, 1, 1), and how many times as large it is
/// made.
struct Placement {
    double offset = 0;
    double scale = 1;
};

struct ChartScene {
    std::string name;
    Topology topology;
    ImageParams params;
    ChartSpace scene_space;
    ChartSpace world_space;
};

/// `positions` in world space, moved and scaled in double and rounded to float once. The
/// image is side x side pixels (a multiple of kChartTileSide), seen from the default view with
/// the given field of view; there are as many aimed rays as `aimed` says. Throws what the builder
/// and the camera do.
ChartScene make_chart_scene(const std::string& name, const Topology& topology,
                            std::span<const vec3> positions, const Placement& placement,
                            std::uint32_t side, std::size_t aimed);

/// Degrees: near enough for most pixels to see the scene.
inline constexpr double kChartFov = 20;

}  // namespace morphray::accuracy
