// Edges at which the surface of a scene is not that of a solid.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "common/interop/platform.h"
#include "common/scene/mesh.h"

namespace mray {

/// The edges where a surface is not that of a solid. Each edge is counted once.
struct EdgeCounts {
    /// Edges of one triangle.
    std::uint64_t open = 0;
    /// Edges of more than two triangles.
    std::uint64_t shared = 0;
    /// Edges of two triangles that both run through them in one direction.
    std::uint64_t turned = 0;
    /// Edges that triangles run through more often in one direction than in the other: all open and
    /// turned ones, and some shared ones. The surface is closed if there are none.
    std::uint64_t uneven = 0;
};

/// Counts the edges of all triangles at these positions (scene space). Vertices at one place are
/// one vertex. Triangles with a corner that is not finite, or with two corners at one place, do not
/// count. O(n log n).
EdgeCounts count_edges(const Topology& topology, std::span<const vec3> positions);

/// "4 open, 0 of more than two triangles, 1 turned", or "closed: 0 open, ...".
std::string describe(const EdgeCounts& counts);

}  // namespace mray
