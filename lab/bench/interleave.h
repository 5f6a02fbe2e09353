// Times several ways to do the same work in turn.
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "common/frame_times.h"
#include "common/report/spread.h"

namespace mray::bench {

/// One way to do a work, which may be cut into parts.
struct Method {
    std::string name;
    /// Called before each round and not timed; may be empty.
    std::function<void()> prepare;
    /// Does a part and returns the milliseconds that it took.
    std::function<double(std::size_t part)> run;
    /// Of the methods of a group the fastest makes a row.
    std::string group = {};
};

/// Calls work(), and returns the milliseconds that it took.
template <class Work>
double timed(const Work& work) {
    const Stopwatch watch;
    work();
    return watch.ms();
}

/// Milliseconds of a method's runs, in the order in which they were made.
using Samples = std::vector<double>;

/// Statistics of the runs of a method, in milliseconds for all parts of the work.
struct Times {
    /// The sum over the parts of the median of the rounds.
    double median_ms = 0;
    /// The sum over the parts of the least of the rounds: what is left where nothing disturbs.
    double least_ms = 0;
};

/// samples[part][round]; at least one part, and as many rounds in each, at least one.
Times times_of(std::span<const Samples> parts);

/// Runs each method once to warm up, then `repeat` rounds of all methods in turn, so that a
/// disturbance that lasts longer than a run affects all. Each method does all parts one after the
/// other, since other methods in between would leave short parts cold caches. Methods take turns
/// in coming first.
std::vector<Times> time_in_turn(std::span<const Method> methods, std::size_t parts, int repeat);

/// Returns the indices of the `count` methods of each group with the least times; groups are in
/// the order of their first methods.
std::vector<std::size_t> fastest_of_groups(std::span<const Method> methods,
                                           std::span<const Times> times, std::size_t count);

}  // namespace mray::bench
