// Times several ways to do the same work in turn.
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "common/report/spread.h"

namespace mray::bench {

/// One way to do the work. `prepare` is called before each run and not timed; it may be empty.
struct Method {
    std::string name;
    std::function<void()> prepare;
    std::function<void()> run;
};

/// One way to do a work that is cut into parts. `prepare` is called before each round and not
/// timed; it may be empty.
struct PartMethod {
    std::string name;
    std::function<void()> prepare;
    std::function<void(std::size_t part)> run;
};

/// Milliseconds of a method's runs, in the order in which they were made.
using Samples = std::vector<double>;

/// Statistics of the runs of a method, in milliseconds for all parts of the work.
struct Times {
    /// The sum over the parts of the median of the rounds.
    double median_ms = 0;
    /// The sum over the parts of the least of the rounds: what is left where nothing disturbs.
    double least_ms = 0;
    /// The sum over the parts of each round.
    Samples rounds;
};

/// The times of a work in one part.
Times times_of(const Samples& samples);
/// samples[part][round]; at least one part, and as many rounds in each, at least one.
Times times_of(std::span<const Samples> parts);

/// Runs each method once to warm up, then `repeat` rounds of all methods in turn, so that a
/// disturbance that lasts longer than a run affects all methods. Returns the samples of each
/// method.
std::vector<Samples> time_interleaved(std::span<const Method> methods, int repeat);

/// As above, for works in parts: each method does all parts one after the other, as it would do an
/// image, because parts are so short that other methods in between would leave it cold caches. A
/// disturbance spoils a few parts of a few rounds. Methods take turns in coming first.
std::vector<Times> time_parts(std::span<const PartMethod> methods, std::size_t parts, int repeat);

/// How many times as fast as the peer morphray is: the ratios of the medians and of the least
/// times, and the smallest and largest ratio of a round.
struct Ratio {
    double median;
    double least;
    double min;
    double max;
};
Ratio ratio_of(const Times& ours, const Times& peer);

}  // namespace mray::bench
