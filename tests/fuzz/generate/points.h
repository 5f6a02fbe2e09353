// Points to ask about.
#pragma once

#include <vector>

#include "tests/fuzz/generate/places.h"

namespace mray::fuzz {

/// Points on a mesh and within ulps of it, on the planes and lines of its triangles, above and
/// below its vertices and edges, anywhere and far away, with large, tiny, denormal and rarely
/// infinite coordinates and NaN.
std::vector<vec3> make_points(Dice& dice, const Surroundings& around, std::size_t count);

/// Groups of points near each other, one after the other: `size` at and around each of
/// make_points().
std::vector<vec3> make_groups(Dice& dice, const Surroundings& around, std::size_t groups,
                              std::size_t size);

}  // namespace mray::fuzz
