// The charts of `morphray chart`: what methods measure, as a table and the figure of it.
#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "common/report/plot.h"
#include "common/report/table.h"
#include "lab/accuracy/chart_scene.h"
#include "lab/accuracy/methods/method.h"
#include "lab/accuracy/referee/exact_referee.h"

namespace mray::accuracy {

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

/// Compares the answers of each method with exact ones. Times are the least of `rounds`.
std::vector<Measured> measure(const ChartScene& scene, std::span<const Method> methods, int rounds);

struct Chart {
    /// The name of its files without an ending.
    std::string name;
    Table table;
    plot::Figure figure;
};

struct Effort {
    /// Pixels a side of the image, a multiple of kChartTileSide.
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
    /// Makes the Vulkan backend; throws Error(kUnavailable) if there is none.
    MakeBackend make_vulkan_backend;
    /// The text below every image: machine and command.
    std::string footer;
};

/// Small scenes on which intersection rules fail: a sphere, far from 0, tiny and huge; needles; a
/// fan of thin triangles; duplicate and coplanar triangles; details of 1 in an extent of 1e6.
std::vector<ChartInput> failure_scenes();

/// Mray/s against wrong answers per million rays, at the origin. File names end in `suffix`.
Chart accuracy_chart(const ChartContext& context, const ChartInput& input,
                     const std::string& suffix);
/// Failure scenes against methods; `more` are added to the program's own scenes.
Chart failure_chart(const ChartContext& context, const std::vector<ChartInput>& more);

}  // namespace mray::accuracy
