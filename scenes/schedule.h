// The best schedule of rebuilds, in hindsight.
#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>
#include <vector>

namespace mray {

/// The costs of frames, update and trace together, by the tree that they were traced with.
struct ScheduleCosts {
    /// first[f]: frame f with the first tree.
    std::vector<double> first;
    /// built[b][i]: frame b + i with a tree built at frame b; i = 0 includes the build. Each has at
    /// least one entry; a schedule cannot use frames beyond the last one, which were not measured.
    std::vector<std::vector<double>> built;
};

struct Schedule {
    double total = 0;
    /// The frames at which a tree is built, ascending.
    std::vector<std::size_t> rebuilds;
};

/// The schedule of least total cost, by dynamic programming over the frame of the last rebuild.
inline Schedule best_schedule(const ScheduleCosts& costs) {
    const std::size_t frames = costs.first.size();
    constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();
    // best[f]: least cost of the frames before f; came_from[f]: where its last tree was built.
    std::vector<double> best(frames + 1, std::numeric_limits<double>::infinity());
    std::vector<std::size_t> came_from(frames + 1, kNone);
    best[0] = 0;
    double with_first = 0;
    for (std::size_t f = 0; f < frames; ++f) {
        with_first += costs.first[f];
        if (with_first < best[f + 1]) {
            best[f + 1] = with_first;
            came_from[f + 1] = kNone;
        }
        double total = best[f];
        for (std::size_t i = 0; i < costs.built[f].size(); ++i) {
            total += costs.built[f][i];
            if (total >= best[f + i + 1]) continue;
            best[f + i + 1] = total;
            came_from[f + i + 1] = f;
        }
    }
    Schedule schedule;
    schedule.total = best[frames];
    for (std::size_t f = frames; f > 0 && came_from[f] != kNone; f = came_from[f])
        schedule.rebuilds.push_back(came_from[f]);
    std::reverse(schedule.rebuilds.begin(), schedule.rebuilds.end());
    return schedule;
}

}  // namespace mray
