// The methods that charts compare, over one scene.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/backend.h"
#include "lab/accuracy/chart_scene.h"
#include "lab/accuracy/score.h"

namespace mray::lab {

/// The same rays in both spaces.
struct ChartRays {
    RaySet scene_space;
    RaySet world_space;
};

/// A method with a way to trace these rays.
struct ChartTracer {
    std::string method;
    /// "ours", "Vulkan", "2007", "Embree fast", "Embree robust" or "rules".
    std::string family;
    bool in_scene_space = true;
    /// Methods that are slow trace fewer rays than the others.
    bool slow = false;
    /// Of a chunk; a few for brute force.
    TileRange tiles;
    Tracer tracer;
};

/// A device, its name in charts, and in full with its driver.
struct ChartDevice {
    std::string name;
    std::string detail;
    std::shared_ptr<Backend> backend;
};

/// What the methods need, made once for a scene, which outlives it.
class ChartMethods {
public:
    /// Hands the scene to the devices.
    ChartMethods(const ChartScene& scene, std::vector<ChartDevice> devices);
    ~ChartMethods();

    /// Of each method that has a way for rays of this kind. The rays outlive the tracers. Methods
    /// of Embree share the memory of their answers, so that these are read after each trace.
    std::vector<ChartTracer> operator()(const ChartRays& rays) const;

private:
    struct Peers;

    const ChartScene& scene_;
    std::vector<ChartDevice> devices_;
    std::unique_ptr<Peers> peers_;
};

/// "Embree 3.13.5", or that there is none.
std::string embree_name();

/// How many rays a chart takes.
struct Effort {
    std::size_t chunk_rays;
    std::size_t chunks;
    /// Of slow methods, and of failure scenes.
    std::size_t slow_chunks;
    std::size_t failure_rays;
};
/// Takes at most a minute for a scene on two cores.
inline constexpr Effort kQuickEffort{
    .chunk_rays = 65'536, .chunks = 4, .slow_chunks = 1, .failure_rays = 8'192};
/// 10^7 rays, of slow methods 10^6; takes some minutes.
inline constexpr Effort kFullEffort{
    .chunk_rays = 262'144, .chunks = 40, .slow_chunks = 4, .failure_rays = 65'536};

/// A method with rays of a kind.
struct ChartPoint {
    RayKind kind;
    std::string method;
    std::string family;
    bool in_scene_space;
    Score score;
};

/// Makes the methods' tracers of some rays; methods come in the same order each time.
using MakeTracers = std::function<std::vector<ChartTracer>(const ChartRays&)>;

/// Speed and accuracy of all methods, each by the same calls with the same rays. Methods trace in
/// turn, so that a disturbance affects all. Calls `done` after each chunk.
std::vector<ChartPoint> measure(const ChartScene& scene, const MakeTracers& make_tracers,
                                RayKind kind, const Effort& effort,
                                const std::function<void()>& done);

}  // namespace mray::lab
