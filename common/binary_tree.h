// The binary tree that a build makes first. It is collapsed to the shared layout and forgotten.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/box.h"
#include "common/bvh_builder.h"
#include "common/mesh.h"

namespace morphray {

/// A triangle as the builder sees it: its box and its id.
struct PrimRef {
    vec3 lower;
    std::uint32_t prim_id;
    vec3 upper;
    std::uint32_t unused;

    Box box() const { return {lower, upper}; }
    /// Twice the centroid of the box along an axis; exact order, no division.
    float centroid2(int axis) const { return lower[axis] + upper[axis]; }
};

/// Preorder: the left child of node i is i + 1. A leaf has right == 0 and owns refs[begin .. end).
struct BinaryNode {
    Box box;
    std::uint32_t begin = 0;
    std::uint32_t end = 0;
    std::uint32_t right = 0;
    /// Levels below; 0 for a leaf. At most kMaxBinaryHeight.
    std::uint32_t height = 0;

    bool is_leaf() const { return right == 0; }
};

/// Four binary levels fit into one wide level in any case.
inline constexpr std::uint32_t kMaxBinaryHeight = 4 * kMaxDepth;

struct BinaryTree {
    std::vector<PrimRef> refs;
    std::vector<BinaryNode> nodes;
};

/// Every leaf fits a meshlet: at most kLeafTriangles triangles over at most kLeafVertices vertices.
/// Empty for no triangles. Runs in the calling thread's arena; the result does not depend on the
/// threads.
BinaryTree build_binary_tree(const Topology& topology, std::span<const vec3> positions,
                             SplitMethod method);

}  // namespace morphray
