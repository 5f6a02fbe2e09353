// Timing several ways to do the same work against each other.
#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "common/base/median.h"

namespace morphray::bench {

/// One way to do the work. `prepare` comes before each run, outside the timing; it may be empty.
struct Method {
    std::string name;
    std::function<void()> prepare;
    std::function<void()> run;
};

/// Milliseconds of a method's runs, in the order in which they were made.
using Samples = std::vector<double>;

/// Runs each once to warm up, then `repeat` rounds of each in turn, so that what disturbs the
/// machine for longer than a run disturbs all alike. One Samples a method.
std::vector<Samples> time_interleaved(std::span<const Method> methods, int repeat);

/// How many times as fast as the peer we are: the ratio of the medians, and the smallest and
/// largest ratio of a round, between which it lies (if every peer[i] >= m * ours[i], then the
/// medians stand alike).
struct Ratio {
    double median;
    double min;
    double max;
};
Ratio ratio_of(const Samples& ours, const Samples& peer);

}  // namespace morphray::bench
