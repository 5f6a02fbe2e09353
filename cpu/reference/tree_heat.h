// The cost of a tree, as colours.
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

/// A colour from dark blue over green to dark red (after A. Mikhailov. Turbo, an improved rainbow
/// colormap for visualization. 2019), in proportion to the logarithm of n: from 2^first to 2^last.
std::uint32_t heat_colour(std::uint32_t n, std::uint32_t first, std::uint32_t last);

/// heat_colour() of a number of steps, from 1 to 256, and of a looseness, from 1 to 64.
std::uint32_t steps_colour(std::uint32_t steps);
std::uint32_t looseness_colour(float looseness);

}  // namespace mray::cpu
