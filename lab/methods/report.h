// Times ways to do the same work in turn, and reports each method of morphray beside a peer.
#pragma once

#include <functional>

#include "common/frame_times.h"
#include "report/machine.h"
#include "report/table.h"

namespace mray::lab {

/// One way to do a work, which may be cut into parts.
struct Method {
    std::string name;
    /// Called before each round, the first of which is -1, and not timed; may be empty.
    std::function<void(int round)> prepare;
    /// Does a part and returns the milliseconds that it took.
    std::function<double(std::size_t part)> run;
    /// Of the methods of a group the fastest makes a row.
    std::string group = {};
    /// Counts the answers of the last run that differ from those of our method; may be empty.
    std::function<std::uint64_t()> differences = {};
};

template <class Work>
double timed(const Work& work) {
    const Stopwatch watch;
    work();
    return watch.ms();
}

/// Sums over the parts of a work, in milliseconds, of the median of the rounds and of the least.
struct Times {
    double median = 0;
    /// What is left where nothing disturbs.
    double least = 0;
};

/// Runs each method once to warm up, then `repeat` rounds of all in turn, so that a disturbance
/// affects all. Each does all parts one after the other, for warm caches. Each comes first in turn.
std::vector<Times> time_in_turn(std::span<const Method> methods, std::size_t parts, int repeat);

/// The `count` quickest of each group, by index; groups are in the order of their first methods.
std::vector<std::size_t> fastest_of_groups(std::span<const Method> methods,
                                           std::span<const Times> times, std::size_t count);

/// Of so many rays, triangles or queries in some milliseconds.
struct Unit {
    const char* name;
    double (*figure)(double ms, double count);
};
inline constexpr Unit kMrayPerSecond{"Mray/s", [](double ms, double n) { return n / (ms * 1e3); }};
inline constexpr Unit kNs{"ns", [](double ms, double n) { return ms * 1e6 / n; }};
inline constexpr Unit kMs{"ms", [](double ms, double) { return ms; }};

struct Row {
    /// primary, shadow, diffuse, ao, one-ray, refit, build or frame, or the name of a query.
    std::string work;
    Unit unit = kMs;
    /// The number of rays, triangles or queries of a run; unused for kMs.
    std::uint64_t count = 0;
    std::string tracer = {};
    std::string peer = {};
    Times ours = {};
    Times theirs = {};
    std::uint64_t differences = 0;
};

/// Prints rows, and writes each at once as comma-separated values (RFC 4180 with \n).
class Report {
public:
    /// `head` comes first. Without a name there is no file. Throws Error if it cannot be written.
    Report(std::string head, std::string file);

    /// The following rows are about this scene, on so many threads.
    void begin(const std::string& scene, int threads);
    void add(const Row& row);
    /// Times methods in turn, the first of which is ours, and adds a row of it beside the fastest
    /// of each other group. Returns how many answers of these differ.
    std::uint64_t compare(Row row, std::span<const Method> methods, std::size_t parts, int repeat);

private:
    std::string head_;
    std::string file_;
    std::string scene_;
    std::string work_;
    int threads_ = 0;
    Table table_;
};

}  // namespace mray::lab
