// The scene of a chart: one frame with its trees and rays.
#pragma once

#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "common/bvh/bvh.h"
#include "common/interop/params.h"
#include "common/interop/ray.h"
#include "common/scene/camera_setup.h"
#include "common/scene/mesh.h"
#include "common/scene/scene_space.h"

namespace mray::accuracy {

/// Camera rays are traced in tiles of this many pixels a side.
inline constexpr std::uint32_t kChartTileSide = 64;
inline constexpr std::size_t kChartTile = std::size_t{kChartTileSide} * kChartTileSide;

/// What a method traces: in scene space for the program's rule, in world space for others.
struct ChartSpace {
    std::vector<vec3> positions;
    Bvh bvh;
    /// Rays of the camera, tile by tile.
    std::vector<Ray> camera_rays;
    /// Rays at vertices, points of edges and of faces, from outside and inside the scene.
    std::vector<Ray> aimed_rays;
};

/// One frame of a scene, in world space.
struct ChartInput {
    std::string name;
    Topology topology;
    std::vector<vec3> positions;
};

struct ChartScene {
    std::string name;
    Topology topology;
    ImageParams params;
    ChartSpace scene_space;
    ChartSpace world_space;
};

/// Numbers of a fixed sequence.
class Random {
public:
    explicit Random(std::uint64_t seed) : bits_(seed) {}

    std::size_t below(std::size_t count) { return bits_() % count; }
    double real(double lower, double upper) {
        return lower + (upper - lower) * static_cast<double>(bits_() >> 11) * 0x1p-53;
    }

private:
    std::mt19937_64 bits_;
};

/// Makes the scene of a frame: side x side pixels (a multiple of kChartTileSide) from the default
/// view with kChartFov, and `aimed` aimed rays. Throws what the builder and the camera throw.
ChartScene make_chart_scene(const ChartInput& input, std::uint32_t side, std::size_t aimed);

/// Field of view in degrees, narrow enough for most pixels to show the scene.
inline constexpr double kChartFov = 20;

}  // namespace mray::accuracy
