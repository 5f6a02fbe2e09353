// Takes triangles out of a tree and puts others in, for meshes that come and go.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/bvh/bvh.h"
#include "common/scene/mesh.h"
#include "common/update/relayout.h"

namespace mray {

/// Triangles in a row that stay in a topology, with the vertices that they and no others have.
struct KeptTriangles {
    IndexRange before;
    /// What is added to their ids and vertices, in the arithmetic of 32 bits.
    std::uint32_t prim_shift;
    std::uint32_t vertex_shift;
};

/// How a topology follows from the one before.
struct TopologyChange {
    /// Ascending; neighbours differ in a shift, or there is something between them.
    std::vector<KeptTriangles> kept;
    /// The new triangles, in ranges of such as lie near each other.
    std::vector<IndexRange> added;

    void keep(const KeptTriangles& triangles);
    /// Those that a triangle is one of, or null if it is gone.
    const KeptTriangles* find(std::uint32_t prim_id) const;
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
