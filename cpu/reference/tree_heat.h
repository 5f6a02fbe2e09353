// The cost of a tree, as numbers for heat_colours.h.
#pragma once

#include <cstdint>
#include <vector>

#include "common/bvh/bvh.h"
#include "common/interop/ray.h"

namespace mray::cpu {

/// The nodes and leaves whose boxes a ray enters no later than its hit, or all along the ray if it
/// has none: what a traversal visits that knows the hit from the start.
std::uint32_t count_steps(const Bvh& bvh, const Ray& ray, const Hit& hit);

/// For each triangle the ratio of the surface area of its leaf's box to twice the area of the
/// leaf's triangles: about 1 for a flat leaf, more the looser it is; the largest number of a float
/// for a leaf without an area. Triangles with a vertex that is not finite have 0.
std::vector<float> leaf_looseness(const Bvh& bvh);

}  // namespace mray::cpu
