// The charts of `morphray chart`: what methods measure, as a table and the figure of it.
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/backend.h"
#include "lab/accuracy/chart_scene.h"
#include "lab/accuracy/exact_referee.h"
#include "report/plot.h"
#include "report/table.h"

namespace mray::lab {

struct VerdictCounts {
    std::array<std::uint64_t, kVerdictCount> of{};
    std::uint64_t rays = 0;

    std::uint64_t operator[](Verdict verdict) const {
        return of[static_cast<std::size_t>(verdict)];
    }
    std::uint64_t wrong() const;
    double wrong_per_million() const;
    VerdictCounts operator+(const VerdictCounts& other) const;
};

/// Answers to camera and aimed rays, and millions of camera rays a second on all threads.
struct Measured {
    std::string method;
    VerdictCounts camera;
    VerdictCounts aimed;
    double mrays = 0;
};

/// A method under test over a space of a scene, which outlives it.
struct ChartMethod {
    std::string name;
    const ChartSpace* space;
    std::function<Tracer(const RaySet&)> tracer;
};

/// Makes a backend; throws Error(kUnavailable) if there is none.
using MakeBackend = std::function<std::unique_ptr<Backend>()>;

/// The scalar reference, single rays and packets on the best SIMD target, and Vulkan.
std::vector<ChartMethod> our_methods(const ChartScene& scene, const MakeBackend& make_vulkan);

/// Compares the answers of each method with exact ones. Times are the least of `rounds`.
std::vector<Measured> measure(const ChartScene& scene, std::span<const ChartMethod> methods,
                              int rounds);

struct Chart {
    /// The name of its files without an ending.
    std::string name;
    Table table;
    plot::Figure figure;
};

struct Effort {
    /// Pixels a side of the image, a multiple of kTileSize.
    std::uint32_t side;
    std::size_t aimed_rays;
    int rounds;
    /// Aimed rays for each failure scene.
    std::size_t failure_rays;
};
/// Takes about half a minute for a scene on two cores.
inline constexpr Effort kQuickEffort{
    .side = 256, .aimed_rays = 50'000, .rounds = 3, .failure_rays = 6'000};
/// Takes some minutes.
inline constexpr Effort kFullEffort{
    .side = 1024, .aimed_rays = 500'000, .rounds = 5, .failure_rays = 50'000};

struct ChartContext {
    const Effort& effort;
    MakeBackend make_vulkan_backend;
    /// The text below every image: machine and command.
    std::string footer;
};

/// Mray/s against wrong answers per million rays, at the origin. File names end in `suffix`.
Chart accuracy_chart(const ChartContext& context, const ChartInput& input,
                     const std::string& suffix);
/// Failure scenes against methods; `more` are added to the program's own scenes.
Chart failure_chart(const ChartContext& context, const std::vector<ChartInput>& more);

}  // namespace mray::lab
