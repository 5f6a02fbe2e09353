// The best moments to rebuild, in hindsight.
#pragma once

#include <cstddef>
#include <vector>

namespace morphray {

/// What frames have cost, update and trace together, by the tree that they were traced with.
struct ScheduleCosts {
    /// first[f]: frame f with the tree that was there at the start.
    std::vector<double> first;
    /// built[b][i]: frame b + i with a tree built at frame b; i = 0 holds the build. At least one
    /// entry each; what lies beyond the last was not measured and is no choice.
    std::vector<std::vector<double>> built;
};

struct Schedule {
    double total = 0;
    /// The frames, ascending, that a tree is built at.
    std::vector<std::size_t> rebuilds;
};

/// The schedule of least total cost, by dynamic programming over the frame of the last rebuild.
Schedule best_schedule(const ScheduleCosts& costs);

/// The total of rebuilding each `period` frames (at frames period, 2 period, ...); negative where
/// the costs that it takes were not measured.
double periodic_total(const ScheduleCosts& costs, std::size_t period);

}  // namespace morphray
