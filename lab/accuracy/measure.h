// Measures the speed of methods and counts their wrong answers.
#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "lab/accuracy/methods/method.h"
#include "lab/accuracy/referee/exact_referee.h"

namespace mray::accuracy {

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

/// A method over a scene: its answers to rays of the camera and to aimed ones, and millions of
/// camera rays a second on all threads.
struct Measured {
    std::string method;
    VerdictCounts camera;
    VerdictCounts aimed;
    double mrays = 0;
};

/// Traces all rays of a scene by each method, and compares the answers with exact ones. The time is
/// the least of `rounds` of all methods in turn, because disturbances of the machine only add time.
/// Checks about every thousandth exact answer against all triangles, and throws Error(kInternal) if
/// they differ.
std::vector<Measured> measure(const ChartScene& scene, std::span<const Method> methods, int rounds);

}  // namespace mray::accuracy
