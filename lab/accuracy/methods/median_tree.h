// A tree without the surface area heuristic: halves by the median along the widest axis.
#pragma once

#include <span>

#include "common/bvh/bvh.h"
#include "common/scene/mesh.h"

namespace mray::accuracy {

/// The tree in the shared layout over positions in scene space; check_bvh accepts it.
Bvh build_median_tree(const Topology& topology, std::span<const vec3> positions);

}  // namespace mray::accuracy
