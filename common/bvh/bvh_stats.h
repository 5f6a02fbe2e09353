// Statistics of a tree.
#pragma once

#include <cstdint>

#include "common/bvh/bvh.h"

namespace mray {

struct BvhStats {
    /// Expected cost of a random ray that hits the root's box, in node visits and triangle tests:
    /// sum over nodes of A(node)/A(root) plus, over leaves, A(leaf)/A(root) * triangles.
    double sah_cost = 0;
    std::uint32_t node_count = 0;
    std::uint32_t leaf_count = 0;
    std::uint32_t depth = 0;
    double children_per_node = 0;
    double triangles_per_leaf = 0;
    double vertices_per_leaf = 0;
    std::uint64_t bytes = 0;
};
BvhStats bvh_stats(const Bvh& bvh);

}  // namespace mray
