// Rays on which tracers differ.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/interop/ray.h"
#include "common/scene/mesh.h"

namespace mray::accuracy {

/// `count` rays in scene space at vertices, at points of edges, at their middles, and at points of
/// triangles; from outside, from inside, from the plane of the triangle, and from a vertex; every
/// eighth runs along an axis. Fewer if the mesh has no finite triangle. The same for a seed on
/// every machine.
std::vector<Ray> aimed_rays(const Topology& topology, std::span<const vec3> positions,
                            std::size_t count, std::uint64_t seed);

}  // namespace mray::accuracy
