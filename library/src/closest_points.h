// The closest points of the meshes, and their distances: an ExactClosestQuery in scene space where
// the place counts, else a ClosestQuery.
#pragma once

#include "library/src/query_plan.h"

namespace morphray::detail {

/// At least the squares of distances by the rule, in scene space, of triangles that are no farther
/// than max_distance. Throws Error for a max_distance that is negative or NaN.
float most_d2(const SceneImpl& scene, float max_distance);

/// Finds the distances of the closest triangles; infinite if there is none. Near a surface and far
/// away they are those of exact places, else those of the rule, which is faster.
std::vector<float> find_distances(const PointPart& part, float most_d2);

}  // namespace morphray::detail
