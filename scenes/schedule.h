// The best schedule of rebuilds, in hindsight.
#pragma once

#include <cstddef>
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
Schedule best_schedule(const ScheduleCosts& costs);

}  // namespace mray
