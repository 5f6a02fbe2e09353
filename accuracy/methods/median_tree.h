// A tree without the surface area heuristic: halves by the median along the widest axis.
#pragma once

#include <span>

#include "common/bvh/bvh.h"
#include "common/scene/mesh.h"

namespace morphray::accuracy {

/// In the shared layout and as sound as the builder's (check_bvh), over positions in scene space.
Bvh build_median_tree(const Topology& topology, std::span<const vec3> positions);

}  // namespace morphray::accuracy
