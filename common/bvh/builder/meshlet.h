// Makes leaves.
#pragma once

#include <cstdint>
#include <span>

#include "common/interop/bvh_layout.h"
#include "common/scene/mesh.h"

namespace mray {

/// The part of a leaf that does not move: which vertices its triangles join.
struct LeafShape {
    std::uint32_t vertex_count;
    /// The packed local vertex indices of each triangle (pack_corners).
    std::uint32_t corners[kLeafTriangles];
    /// The first vertex_count are set.
    std::uint32_t vertices[kLeafVertices];
};

/// Returns whether triangles (1 to kLeafTriangles, ascending) have few enough vertices for a leaf;
/// sets its shape if so.
bool find_leaf_shape(const Topology& topology, std::span<const std::uint32_t> prim_ids,
                     LeafShape& shape);

/// Writes a leaf of this shape at these positions, and to leaf_vertices[0 .. 16) the vertices of
/// its slots.
void fill_leaf(const LeafShape& shape, std::span<const std::uint32_t> prim_ids,
               std::span<const vec3> positions, Leaf& leaf, std::uint32_t* leaf_vertices);

}  // namespace mray
