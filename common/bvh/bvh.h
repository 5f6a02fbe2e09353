// A BVH in the shared layout, with the links that refits and checks follow.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/base/aligned_vector.h"
#include "common/interop/bvh_layout.h"

namespace mray {

/// nodes[0] is the root, present even for no triangles. Nodes are in breadth-first order: level l
/// is nodes[level_begin[l] .. level_begin[l + 1]), and depth() levels exist. Leaves are in the
/// order in which a breadth-first walk meets them.
struct Bvh {
    AlignedVector<Node> nodes;
    AlignedVector<Leaf> leaves;
    /// For each leaf, the vertices that its 16 slots take their positions from.
    std::vector<std::uint32_t> leaf_vertices;
    /// node * kWidth + slot that refers to this node or leaf; kNoParent for the root.
    std::vector<std::uint32_t> node_parents;
    std::vector<std::uint32_t> leaf_parents;
    std::vector<std::uint32_t> level_begin;
    std::uint32_t triangle_count = 0;

    std::uint32_t depth() const { return static_cast<std::uint32_t>(level_begin.size()) - 1; }
};

inline constexpr std::uint32_t kNoParent = 0xFFFFFFFFu;

/// XXH3 (64 bits) of the node array and the leaf array.
std::uint64_t bvh_hash(const Bvh& bvh);

}  // namespace mray
