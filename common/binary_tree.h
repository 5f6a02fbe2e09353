// The binary tree that a build makes first. It is collapsed to the shared layout and forgotten.
#pragma once

#include <cstdint>
#include <span>

#include "common/aligned_vector.h"
#include "common/box.h"
#include "common/bvh_builder.h"
#include "common/mesh.h"
#include "common/prim_ref.h"

namespace morphray {

struct BinaryNode {
    Box box;
    /// The triangles below: prim_ids[begin .. end).
    std::uint32_t begin;
    std::uint32_t end;
    /// The left child; the right one is the next. 0 for a leaf.
    std::uint32_t children;
    /// Levels below; 0 for a leaf. At most kMaxBinaryHeight.
    std::uint32_t height;

    bool is_leaf() const { return children == 0; }
    std::uint32_t size() const { return end - begin; }
};

/// Four binary levels fit into one wide level in any case.
inline constexpr std::uint32_t kMaxBinaryHeight = 4 * kMaxDepth;

struct BinaryTree {
    /// Ascending in every leaf.
    AlignedVector<std::uint32_t> prim_ids;
    /// The root first. Where else a node stands is chance: only what it refers to counts.
    AlignedVector<BinaryNode> nodes;
};

/// Every leaf fits a meshlet: at most kLeafTriangles triangles over at most kLeafVertices vertices.
/// No nodes for no triangles. Runs in the calling thread's arena; the tree (but for the places of
/// its nodes) does not depend on the threads.
BinaryTree build_binary_tree(const Topology& topology, std::span<const vec3> positions,
                             SplitMethod method);

/// The box of a triangle, without vertices that are not finite.
PrimRef make_ref(const Topology& topology, std::span<const vec3> positions, std::uint32_t prim_id);

/// Likewise over triangles and, above them, parts of any kind that are left as they are: a ref's
/// prim_id is that of a triangle, or of a part if it is at least topology.triangles.size(). A part
/// is a leaf of its own. The refs ascend by prim_id, and are used up.
BinaryTree build_binary_tree(const Topology& topology, AlignedVector<PrimRef>& refs,
                             SplitMethod method);

}  // namespace morphray
