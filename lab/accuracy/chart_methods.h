// The methods that charts compare, over one scene.
#pragma once

#include <memory>

#include "common/backend.h"
#include "lab/accuracy/chart_scene.h"
#include "lab/accuracy/score.h"

namespace mray::gpu {
struct SharedDevice;
}

namespace mray::lab {

/// Rays in both spaces.
struct ChartRays {
    RaySet scene_space;
    RaySet world_space;
};

/// A device, its name in charts, and in full with its driver.
struct ChartDevice {
    std::string name;
    std::string detail;
    std::shared_ptr<gpu::SharedDevice> device;
    std::shared_ptr<Backend> backend;
};

/// All Vulkan devices that can be used, lavapipe among them.
std::vector<ChartDevice> open_devices();

/// Makes the methods' tracers of some rays, which outlive them; methods come in the same order each
/// time. Methods of Embree share the memory of their answers, so that these are read after each
/// trace.
using MakeTracers = std::function<std::vector<Tracer>(const ChartRays&)>;

/// All methods that have a way for rays of a kind, over a scene that outlives them. Hands the scene
/// to the devices.
MakeTracers chart_methods(const ChartScene& scene, const std::vector<ChartDevice>& devices);

/// "Embree 3.13.5", or that there is none.
std::string embree_name();

/// How many rays a chart takes.
struct Effort {
    std::size_t chunk_rays;
    std::size_t chunks = 1;
    /// Of slow methods, a divisor of `chunks`; and the rays of failure scenes.
    std::size_t slow_chunks = 1;
    std::size_t failure_rays = 0;
    /// Each method traces a chunk so many times; the median time counts.
    std::size_t rounds = 1;
};
/// Takes at most a minute for a scene on two cores.
inline constexpr Effort kQuickEffort{
    .chunk_rays = 65'536, .chunks = 4, .slow_chunks = 4, .failure_rays = 8'192};
/// 10^7 rays, of slow methods 10^6; takes some minutes.
inline constexpr Effort kFullEffort{
    .chunk_rays = 262'144, .chunks = 40, .slow_chunks = 4, .failure_rays = 65'536};

/// A method with rays of a kind.
struct ChartPoint {
    std::string method;
    std::string family;
    Score score;
};

/// True if methods of a family trace scene space, as the program's own do; others trace world
/// space.
inline bool in_scene_space(const std::string& family) {
    return family == "ours" || family == "Vulkan";
}

/// Speed and accuracy of all methods, each by the same calls with the same rays. Methods trace in
/// turn, so that a disturbance affects all. Calls `done` after each chunk.
std::vector<ChartPoint> measure(const ChartScene& scene, const MakeTracers& make_tracers,
                                RayKind kind, const Effort& effort,
                                const std::function<void()>& done);

}  // namespace mray::lab
