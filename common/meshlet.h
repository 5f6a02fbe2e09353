// How a leaf is written.
#pragma once

#include <span>

#include "common/interop/layout.h"
#include "common/mesh.h"

namespace morphray {

/// Writes triangles (at most kLeafTriangles that fit, ascending) at these positions, and the
/// vertices that the 16 slots take theirs from.
void fill_leaf(const Topology& topology, std::span<const vec3> positions,
               std::span<const std::uint32_t> prim_ids, Leaf& leaf, std::uint32_t* leaf_vertices);

}  // namespace morphray
