// A BVH in the shared layout, with the links that refits and checks follow.
#pragma once

#include <algorithm>
#include <compare>

#include "common/base/aligned_vector.h"
#include "common/bvh/node.h"
#include "common/scene/mesh.h"

namespace mray {

/// A triangle with the vertices of another one in the same order, its stand-in of lower prim_id.
struct RepeatedTriangle {
    std::uint32_t first;
    std::uint32_t prim_id;

    auto operator<=>(const RepeatedTriangle&) const = default;
};

/// nodes[0] is the root, present even for no triangles. Nodes are in breadth-first order: level l
/// is nodes[level_begin[l] .. level_begin[l + 1]). A build puts leaves in breadth-first order, too.
struct Bvh {
    AlignedVector<Node> nodes;
    AlignedVector<Leaf> leaves;
    /// For each leaf, the vertices that its 16 slots take their positions from.
    std::vector<std::uint32_t> leaf_vertices;
    /// The slot that refers to this node or leaf (parent_at()); kNoParent for the root.
    std::vector<std::uint32_t> node_parents;
    std::vector<std::uint32_t> leaf_parents;
    std::vector<std::uint32_t> level_begin;
    /// The triangles that are in no leaf because an earlier one is the same, ascending.
    std::vector<RepeatedTriangle> repeated;
    std::uint32_t triangle_count = 0;

    std::uint32_t depth() const { return static_cast<std::uint32_t>(level_begin.size()) - 1; }
};

/// The assumed cost of a leaf in visits of a node. (bvh_stats counts triangles.)
inline constexpr double kLeafCost = 12;

/// The triangles that `first` stands for besides itself.
inline std::span<const RepeatedTriangle> repeats_of(std::span<const RepeatedTriangle> repeated,
                                                    std::uint32_t first) {
    const auto [begin, end] = std::equal_range(
        repeated.begin(), repeated.end(), RepeatedTriangle{first, 0},
        [](const RepeatedTriangle& a, const RepeatedTriangle& b) { return a.first < b.first; });
    return {begin, end};
}

/// The first of `prim_id` and its repeats for which sees(prim_id) is true, or kNoPrim.
template <class Sees>
std::uint32_t first_seen(const Bvh& bvh, std::uint32_t prim_id, Sees sees) {
    if (sees(prim_id)) return prim_id;
    for (const RepeatedTriangle& repeat : repeats_of(bvh.repeated, prim_id))
        if (sees(repeat.prim_id)) return repeat.prim_id;
    return kNoPrim;
}

/// Returns the lowest and the highest prim_id of each subtree, repeated triangles included: first
/// for each node, then for each leaf. O(triangles).
std::vector<IndexRange> prim_ranges(const Bvh& bvh);

/// Adds triangles to those that a tree has in no leaf.
void add_repeated(Bvh& bvh, std::vector<RepeatedTriangle> more);

/// XXH3 (64 bits) of the node array and the leaf array.
std::uint64_t bvh_hash(const Bvh& bvh);

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
