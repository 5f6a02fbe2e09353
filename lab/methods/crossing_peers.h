// Peers that find the pairs of triangles of a mesh that cross.
#pragma once

#include <functional>
#include <string>

#include "common/scene/mesh.h"

namespace mray::lab {

struct CrossingPeer {
    std::string name;
    /// True if it finds the pairs of morphray in meshes whose vertices have different places.
    bool is_exact;
    /// Counts the pairs at these positions, in one thread. The tree of CGAL is new each time, that
    /// of FCL is refitted.
    std::function<std::size_t(std::span<const vec3> positions)> count;
};

/// CGAL's self_intersections() decides exactly; it is left out for a mesh that it cannot hold. FCL
/// decides in floats, and counts pairs that only share a vertex or an edge, too.
std::vector<CrossingPeer> crossing_peers(const Topology& topology, std::span<const vec3> positions);

}  // namespace mray::lab
