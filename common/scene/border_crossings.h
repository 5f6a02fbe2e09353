// Hits of a ray through an edge or a vertex that several triangles share.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/interop/ray.h"
#include "common/scene/mesh.h"

namespace mray {

/// Keeps of the hits through one edge or vertex of a mesh the first, and all through the inside of
/// a triangle. `hits` are all that the ray has by the hit rule, in the order of (t, prim_id), so
/// that the closest one stays. Edges and vertices are one if they lie at one place in one mesh,
/// whose first prim_id is in `first_prims`. That a ray goes through them is exact.
void keep_one_of_each_crossing(const Topology& topology, std::span<const vec3> positions,
                               std::span<const std::uint32_t> first_prims, const Ray& ray,
                               std::vector<Hit>& hits);

}  // namespace mray
