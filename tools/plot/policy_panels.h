// Panels that compare update policies, for `morphray chart` and `profile --plot`.
#pragma once

#include <string>
#include <vector>

#include "tools/measure/policy_runs.h"
#include "tools/plot/figure.h"

namespace mray::plot {

/// Four panels, for two columns: by frame the time of trace, the quality of the tree and the time
/// of update and trace; the total by how long a tree is used, together with that of trees that are
/// rebuilt every K frames. `frames` is the title of the axis of frames.
std::vector<Panel> policy_panels(const PolicyComparison& comparison, const std::string& frames);

}  // namespace mray::plot
