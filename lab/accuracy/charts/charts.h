// The charts of `morphray chart`. Each function measures and returns a table and the figure of it.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/report/plot.h"
#include "common/report/table.h"
#include "lab/accuracy/chart_scene.h"
#include "lab/accuracy/measure/failure_scenes.h"
#include "lab/accuracy/methods/method.h"
#include "scenes/scene_frames.h"

namespace mray::accuracy {

struct Chart {
    /// The name of its files without an ending.
    std::string name;
    /// One or two sentences on how to read the chart.
    std::string caption;
    Table table;
    /// Without panels if there is nothing to draw.
    plot::Figure figure;
};

/// How much work goes into the charts.
struct Effort {
    /// Pixels a side of the image, a multiple of kChartTileSide.
    std::uint32_t side;
    std::size_t aimed_rays;
    int rounds;
    /// Rays for each placement of the scene and for each failure scene.
    std::size_t placed_rays;
    std::vector<double> offsets;
    std::vector<double> scales;
    /// The most frames of a clip, at least 2.
    std::size_t policy_frames;
    /// Points that cones of 1,024 rays start from.
    std::size_t cone_points;
    std::vector<std::uint64_t> triangle_counts;
};
/// Takes about a minute, or about ten, for a scene on two cores.
const Effort& quick_effort();
const Effort& full_effort();

struct ChartContext {
    const Effort& effort;
    /// CPU threads of builds; 0: as many as the machine has.
    int threads = 0;
    /// Makes the CPU backend.
    MakeBackend make_cpu_backend;
    /// Makes the Vulkan backend; throws Error(kUnavailable) if there is none.
    MakeBackend make_vulkan_backend;
    /// The text below every image: machine and command.
    std::string footer;
    /// Called after each step.
    std::function<void()> step;
    /// Called often during long work; throws to end it.
    std::function<void()> check = [] {};
};

/// One frame of a scene, in world space.
struct ChartInput {
    std::string name;
    Topology topology;
    std::vector<vec3> positions;
};

// The number of steps of each chart.
std::size_t accuracy_steps();
std::size_t placement_steps(const Effort& effort);
std::size_t packet_steps();
std::size_t cone_steps();
std::size_t policy_steps();
std::size_t tree_steps();
std::size_t box_steps();
std::size_t scaling_steps(const Effort& effort);
std::size_t failure_steps();

/// Mray/s against wrong answers per million rays for all methods, at the origin. `suffix`
/// distinguishes the file names of several scenes.
Chart accuracy_chart(const ChartContext& context, const ChartInput& input,
                     const std::string& suffix);
/// Wrong answers far from the origin and at small and large scales, for methods that trace single
/// rays.
Chart placement_chart(const ChartContext& context, const ChartInput& input,
                      const std::string& suffix);
/// The size of a packet of camera rays against Mray/s.
Chart packet_chart(const ChartContext& context, const ChartInput& input, const std::string& suffix);
/// The angle of cones of any-hit rays against Mray/s: packets, streams, single rays.
Chart cone_chart(const ChartContext& context, const ChartInput& input, const std::string& suffix);
/// Time of trace, quality of the tree and time of update by frame, for each update policy. A scene
/// with one frame has neither table nor image, and the caption says so.
Chart policy_chart(const ChartContext& context, SceneFrames& scene, const std::string& suffix);
/// Kinds of trees against Mray/s of the program's tracers.
Chart tree_chart(const ChartContext& context, SceneFrames& scene, const std::string& suffix);
/// Box tests and precisions of nodes: Mray/s, bytes and wrong answers.
Chart box_chart(const ChartContext& context, const ChartInput& input, const std::string& suffix);
/// The number of triangles against build, refit and trace.
Chart scaling_chart(const ChartContext& context);
/// Failure scenes against methods; `more` are added to the program's own scenes.
Chart failure_chart(const ChartContext& context, const std::vector<ChartInput>& more);

}  // namespace mray::accuracy
