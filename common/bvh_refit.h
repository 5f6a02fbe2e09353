// The two steps of a refit, each on one element; who calls them in which threads is another matter.
#pragma once

#include <span>

#include "common/box.h"
#include "common/bvh.h"

namespace morphray {

/// Copies the positions of a leaf's vertices into it and gives its parent's slot their bounds.
/// Vertices that are not finite are copied, but bound nothing.
inline void refit_leaf(Bvh& bvh, std::uint32_t leaf_index, std::span<const vec3> positions) {
    Leaf& leaf = bvh.leaves[leaf_index];
    const std::uint32_t* source = &bvh.leaf_vertices[std::size_t{leaf_index} * kLeafVertices];
    Box box;
    for (std::uint32_t slot = 0; slot < kLeafVertices; ++slot) {
        const vec3 p = positions[source[slot]];
        leaf.vertex[slot].x = p.x;
        leaf.vertex[slot].y = p.y;
        leaf.vertex[slot].z = p.z;
        if (is_finite_vertex(p)) box.extend(p);
    }
    const std::uint32_t parent = bvh.leaf_parents[leaf_index];
    set_slot_box(bvh.nodes[parent / kWidth], parent % kWidth, box);
}

/// Gives the parent's slot of a node, whose own slots are up to date, their union.
inline void refit_node(Bvh& bvh, std::uint32_t node_index) {
    const std::uint32_t parent = bvh.node_parents[node_index];
    if (parent == kNoParent) return;
    set_slot_box(bvh.nodes[parent / kWidth], parent % kWidth, node_box(bvh.nodes[node_index]));
}

}  // namespace morphray
