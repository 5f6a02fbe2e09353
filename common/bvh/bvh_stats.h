// What a tree is worth, and whether it is one.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/bvh/bvh.h"
#include "common/scene/mesh.h"

namespace morphray {

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

/// Triangles that no ray can hit at these positions (scene space).
struct DegenerateCount {
    std::uint64_t not_finite = 0;
    std::uint64_t zero_area = 0;
};
DegenerateCount count_degenerate(const Topology& topology, std::span<const vec3> positions);

/// Every broken invariant in words, at most `limit` of them; empty for a sound tree. Checked: the
/// breadth-first order and parents, each triangle in exactly one leaf with the right vertices at
/// the right positions, used slots before unused ones, and each slot's box equal to (not merely
/// around) the bounds of what is below it.
std::vector<std::string> check_bvh(const Bvh& bvh, const Topology& topology,
                                   std::span<const vec3> positions, std::size_t limit = 10);

}  // namespace morphray
