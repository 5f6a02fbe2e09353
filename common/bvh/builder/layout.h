// Lays a collapsed binary tree out as a tree, with subtrees of an older one below it.
#pragma once

#include "common/bvh/builder/binary_tree.h"

namespace mray {

/// Half the area of the box of each node and leaf when it was placed, over the growth until then.
struct BuiltAreas {
    std::vector<float> nodes;
    std::vector<float> leaves;
};

/// The parts of a tree under new levels.
struct TreeParts {
    /// The child entries, in the old tree, of subtrees that stay as they are, and their boxes.
    std::vector<std::uint32_t> subtrees;
    std::vector<Box> boxes;
    std::vector<std::uint32_t> removed_leaves;
};

/// Makes `bvh` a tree of the levels of `binary`, whose leaves are triangles or, from the number of
/// triangles on, the subtrees of `parts` in the tree that bvh is before; for a new tree it is
/// empty. Nodes are breadth first; new leaves take the places of removed ones, then those at the
/// end, in order. `areas` are those of bvh. Returns false, and changes neither, if the tree would
/// become too deep. Runs in the calling thread's arena; only a new tree may be cancelled.
bool lay_out(const Topology& topology, std::span<const vec3> positions, BinaryTree& binary,
             const TreeParts& parts, double growth, const Watch& watch, Bvh& bvh,
             BuiltAreas& areas);

}  // namespace mray
