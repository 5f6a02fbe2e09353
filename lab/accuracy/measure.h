// Measures the speed of methods and counts their wrong answers.
#pragma once

#include <array>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "lab/accuracy/methods/method.h"
#include "lab/accuracy/referee/exact_referee.h"

namespace mray::accuracy {

/// The columns of wrong and of other answers that are not right, as verdict_cells() has them.
inline const std::vector<std::string> kVerdictColumns = {
    "leaks", "false misses", "false hits", "wrong triangles", "close", "displaced", "beside"};

struct VerdictCounts {
    std::array<std::uint64_t, kVerdictCount> of{};
    std::uint64_t rays = 0;
    /// The largest difference of t among the close and the wrong triangles, in ulps.
    double worst_ulps = 0;

    std::uint64_t operator[](Verdict verdict) const {
        return of[static_cast<std::size_t>(verdict)];
    }
    std::uint64_t wrong() const;
    double wrong_per_million() const;
    VerdictCounts operator+(const VerdictCounts& other) const;
};

std::vector<std::string> verdict_cells(const VerdictCounts& counts);

/// The exact answers to all rays of a scene in one of its spaces. The scene outlives it.
class Judge {
public:
    /// Computes the exact answers in parallel. Checks about every thousandth one against all
    /// triangles and throws Error(kInternal) if they differ.
    Judge(const ChartScene& scene, const ChartSpace& space);

    VerdictCounts camera(std::span<const Hit> hits) const;
    VerdictCounts aimed(std::span<const Hit> hits) const;

private:
    std::vector<Truth> truths_of(std::span<const Ray> rays) const;
    VerdictCounts count(std::span<const Ray> rays, std::span<const Truth> truths,
                        std::span<const Hit> hits) const;

    const ChartSpace* space_;
    ExactReferee referee_;
    std::vector<Truth> camera_;
    std::vector<Truth> aimed_;
};

/// Traces all rays of a kind on all threads.
void trace_camera(const Method& method, const ChartScene& scene, std::span<Hit> hits);
void trace_aimed(const Method& method, const ChartScene& scene, std::span<Hit> hits);

/// The least milliseconds of `rounds` runs of each, in turn, after one to warm up. The least
/// counts, because disturbances of the machine only add time.
std::vector<double> least_times(std::span<const std::function<void()>> runs, int rounds);

}  // namespace mray::accuracy
