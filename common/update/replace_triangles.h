// Takes triangles out of a tree and puts others in, for meshes that come and go.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/bvh/bvh.h"
#include "common/scene/mesh.h"
#include "common/update/relayout.h"

namespace mray {

/// How a topology follows from the one before.
struct TopologyChange {
    /// The new id of each old triangle, ascending; kNoPrim for one that is gone.
    std::vector<std::uint32_t> prim_ids;
    /// The new number of each old vertex; any number for one that is gone.
    std::vector<std::uint32_t> vertices;
    /// The new triangles, in ranges of such as lie near each other.
    std::vector<IndexRange> added;
};

/// Makes a tree over the triangles before a change one over those after it: leaves with triangles
/// that are gone are taken apart, and so are the nodes around the added triangles that are larger
/// than these; new levels are built over the rest, as restructure() does. The boxes of what stays
/// are those that the tree had: a refit of all has to follow. Writes `areas`, too. `growth` is 1 if
/// areas are those of the positions.
///
/// Returns false if a build would not cost much more, or if the tree would become too deep; then
/// the tree is of no use any more. Runs in the calling thread's arena. O(n) in leaves and vertices,
/// with a build over what changed.
bool replace_triangles(const Topology& topology, std::span<const vec3> positions,
                       const TopologyChange& change, Bvh& bvh, BuiltAreas& areas);

}  // namespace mray
