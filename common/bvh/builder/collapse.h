// Chooses the descendants of a binary node that become the children of a wide node.
#pragma once

#include "common/bvh/builder/binary_tree.h"

namespace mray {

/// The children of a wide node, left to right.
class WideChildren {
public:
    void add(std::uint32_t binary_node) { nodes_[size_++] = binary_node; }
    std::span<const std::uint32_t> nodes() const { return {nodes_.data(), size_}; }

private:
    std::array<std::uint32_t, kWidth> nodes_;
    std::size_t size_ = 0;
};

/// Finds for every binary node the cheapest way to cut its subtree into wide nodes. The cost is the
/// sum of the areas of the wide nodes, to which a random ray's node visits are proportional (after
/// H. Ylitie, T. Karras, S. Laine. Efficient incoherent ray traversal on GPUs through compressed
/// wide BVHs. HPG 2017, section 3).
class Collapse {
public:
    /// Keeps the costs in `spare` of the tree while this lives. Runs in the calling thread's arena.
    explicit Collapse(BinaryTree& tree);

    /// Returns the 2 to kWidth children of the wide node that an inner binary node becomes at this
    /// depth. If its height is at most 4 times the levels left, this one included, it fits in them.
    WideChildren children(std::uint32_t node, std::uint32_t depth) const;

private:
    struct Costs {
        /// cost[i]: that of the subtree's wide nodes if it fills up to i + 1 slots of its parent.
        alignas(16) std::array<float, kWidth> cost;
        /// How many of those slots the left child gets; 0: the node takes a single slot.
        std::array<std::uint8_t, kWidth> left_slots;
    };

    void find_costs(std::uint32_t node);
    void add_optimal(std::uint32_t node, std::uint32_t slots, WideChildren& out) const;
    void add_levels(std::uint32_t node, std::uint32_t height_limit, WideChildren& out) const;

    std::span<const BinaryNode> nodes_;
    /// The costs of each node.
    Costs* costs_;
};

}  // namespace mray
