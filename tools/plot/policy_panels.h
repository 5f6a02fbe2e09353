// Panels that compare update policies, for `morphray chart` and `profile --plot`.
#pragma once

#include <string>
#include <vector>

#include "tools/measure/policy_runs.h"
#include "tools/plot/figure.h"

namespace mray::plot {

/// Four panels, for two columns. Three show a value by frame: trace time, cost ratio of the tree,
/// and update and trace time together. The fourth shows the total time by the number of frames that
/// a tree is used for, with that of rebuilding every K frames. `frames` is the title of the axis of
/// frames. Bars reach from the least to the largest value of the rounds.
std::vector<Panel> policy_panels(const PolicyComparison& comparison, const std::string& frames);

}  // namespace mray::plot
