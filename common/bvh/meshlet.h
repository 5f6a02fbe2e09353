// How a leaf is made.
#pragma once

#include <cstdint>
#include <span>

#include "common/interop/bvh_layout.h"
#include "common/scene/mesh.h"

namespace morphray {

/// Which vertices a leaf's triangles join: all of a leaf that does not move.
struct LeafShape {
    std::uint32_t vertex_count;
    /// Of each triangle, as in the leaf.
    std::uint32_t corners[kLeafTriangles];
    /// The first vertex_count are set.
    std::uint32_t vertices[kLeafVertices];
};

/// Whether triangles (1 to kLeafTriangles, ascending) have few enough vertices for a leaf; sets
/// its shape if so.
bool find_leaf_shape(const Topology& topology, std::span<const std::uint32_t> prim_ids,
                     LeafShape& shape);

/// Writes triangles of this shape at these positions, and the vertices that the 16 slots take
/// theirs from.
void fill_leaf(const LeafShape& shape, std::span<const std::uint32_t> prim_ids,
               std::span<const vec3> positions, Leaf& leaf, std::uint32_t* leaf_vertices);

}  // namespace morphray
