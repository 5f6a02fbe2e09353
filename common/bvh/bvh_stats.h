// Statistics of a tree, and the check of its invariants.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/bvh/bvh.h"
#include "common/scene/mesh.h"

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

/// Returns a message for each broken invariant, at most `limit`; empty for a sound tree. Checks the
/// breadth-first order and the parents, that each triangle is in exactly one leaf with the right
/// vertices at the right positions (or, instead, one of the same vertices with a lower prim_id),
/// that used slots come before unused ones, and that each slot's box is equal to the bounds of the
/// subtree below it.
std::vector<std::string> check_bvh(const Bvh& bvh, const Topology& topology,
                                   std::span<const vec3> positions, std::size_t limit = 10);

}  // namespace mray
