// Times several ways to do the same work in turn.
#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "common/base/median.h"

namespace mray::bench {

/// One way to do the work. `prepare` is called before each run and not timed; it may be empty.
struct Method {
    std::string name;
    std::function<void()> prepare;
    std::function<void()> run;
};

/// Milliseconds of a method's runs, in the order in which they were made.
using Samples = std::vector<double>;

/// Runs each method once to warm up, then `repeat` rounds of all methods in turn, so that a
/// disturbance that lasts longer than a run affects all methods. Returns the samples of each
/// method.
std::vector<Samples> time_interleaved(std::span<const Method> methods, int repeat);

/// How many times as fast as the peer morphray is: the ratio of the medians, and the smallest and
/// largest ratio of a round. The ratio of the medians lies between those: if every
/// peer[i] >= m * ours[i], then the medians have the same relation.
struct Ratio {
    double median;
    double min;
    double max;
};
Ratio ratio_of(const Samples& ours, const Samples& peer);

}  // namespace mray::bench
