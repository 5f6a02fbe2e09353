// Takes triangles out of a tree and puts others in, for meshes that come and go.
#pragma once

#include "common/bvh/bvh.h"
#include "common/scene/mesh.h"
#include "common/update/restructure.h"

namespace mray {

/// Triangles in a row that stay in a topology, with the vertices that they and no others have.
struct KeptTriangles {
    IndexRange before;
    /// Added to their ids and vertex numbers, modulo 2^32.
    std::uint32_t prim_shift;
    std::uint32_t vertex_shift;
};

/// The difference between two topologies: triangles that stay, and new ones.
struct TopologyChange {
    /// Ascending; neighbours differ in a shift, or there is something between them.
    std::vector<KeptTriangles> kept;
    /// The new triangles, in ranges of such as lie near each other.
    std::vector<IndexRange> added;

    void keep(const KeptTriangles& triangles);
    /// The kept triangles that prim_id is one of, or null if it is gone.
    const KeptTriangles* find(std::uint32_t prim_id) const;
};

/// Brings a tree from the triangles before a change to those after it. Leaves with triangles that
/// are gone, or of several ranges, are taken apart, and so are larger nodes around added triangles.
/// New levels are built over the rest, as restructure() does. What stays keeps its boxes: if it
/// has moved, a refit has to follow. Writes `areas`, too, which are relative to those positions.
///
/// Returns false if a build would not cost much more, or if the tree would become too deep; then
/// the tree is of no use any more. Runs in the calling thread's arena. O(n) in leaves and vertices,
/// with a build over what changed.
bool replace_triangles(const Topology& topology, std::span<const vec3> positions,
                       const TopologyChange& change, Bvh& bvh, BuiltAreas& areas);

}  // namespace mray
