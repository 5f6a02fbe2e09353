// The binary tree that a build makes first, collapses to the shared layout and then discards.
#pragma once

#include "common/base/aligned_vector.h"
#include "common/bvh/box.h"
#include "common/bvh/builder/bvh_builder.h"
#include "common/bvh/builder/split.h"
#include "common/bvh/bvh.h"
#include "common/scene/mesh.h"

namespace mray {

/// The part of a leaf that does not move: which vertices its triangles join.
struct LeafShape {
    std::uint32_t vertex_count;
    /// The packed local vertex indices of each triangle (pack_corners).
    std::uint32_t corners[kLeafTriangles];
    /// The first vertex_count are set.
    std::uint32_t vertices[kLeafVertices];
};

/// Sets the shape of a leaf of triangles (1 to kLeafTriangles, ascending); false if they do not
/// fit.
bool find_leaf_shape(const Topology& topology, std::span<const std::uint32_t> prim_ids,
                     LeafShape& shape);

/// Writes a leaf of this shape, and to leaf_vertices[0 .. 16) the vertices of its slots.
void fill_leaf(const LeafShape& shape, std::span<const std::uint32_t> prim_ids,
               std::span<const vec3> positions, Leaf& leaf, std::uint32_t* leaf_vertices);

struct BinaryNode {
    /// In a union, so that constructing a node writes nothing: most nodes of the array are unused.
    union {
        Box box;
    };
    /// The triangles below: prim_ids[begin .. end).
    std::uint32_t begin;
    std::uint32_t end;
    /// The left child; the right one is the next. 0 for a leaf.
    std::uint32_t children;
    /// Levels below; 0 for a leaf. At most kMaxBinaryHeight.
    std::uint32_t height;

    BinaryNode() {}

    bool is_leaf() const { return children == 0; }
    std::uint32_t size() const { return end - begin; }
};

/// Four binary levels fit into one wide level in any case. No tree of kMaxTriangles is higher.
inline constexpr std::uint32_t kMaxBinaryHeight = 4 * kMaxDepth;

class BinaryTree {
public:
    /// The triangles of a leaf, ascending.
    std::span<const std::uint32_t> triangles(const BinaryNode& leaf) const {
        return std::span(prim_ids).subspan(leaf.begin, leaf.size());
    }

    /// The shape of a leaf of triangles.
    LeafShape shape(const BinaryNode& leaf) const;
    void set_shape(const BinaryNode& leaf, const LeafShape& shape);

    /// Ascending in every leaf.
    AlignedVector<std::uint32_t> prim_ids;
    /// The root first. The places of the others depend on the threads, and some elements are
    /// unused: only those that the tree refers to count.
    AlignedVector<BinaryNode> nodes;
    /// The refs that the build began with. Leaves keep their shapes in the memory of their refs.
    AlignedVector<PrimRef> refs;
    /// The triangles that no node has, in no order.
    std::vector<RepeatedTriangle> repeated;
    /// Memory of the build, then of the collapse's costs, then of leaves: the system takes as long
    /// to clear fresh memory as a split takes to fill it.
    AlignedVector<Leaf> spare;
};

/// Every leaf fits a meshlet: at most kLeafTriangles triangles over at most kLeafVertices vertices.
/// No nodes for no triangles. Runs in the calling thread's arena; the tree (but for the places of
/// its nodes) depends on neither threads nor target. Neighbours in the list that share an edge are
/// mostly kept together (pair_refs). Throws Error(kCancelled) soon after the watch asks for it.
BinaryTree build_binary_tree(const Topology& topology, std::span<const vec3> positions,
                             const SimdTarget& target = best_simd_target(),
                             const Watch& watch = {});

/// A tree over triangles and, after them, parts of any kind that are left as they are: a ref's
/// prim_id is that of a triangle, or of a part if it is at least topology.triangles.size(). A part
/// is a leaf of its own. The refs ascend by prim_id, and none is a pair.
BinaryTree build_binary_tree(const Topology& topology, AlignedVector<PrimRef> refs,
                             const SimdTarget& target = best_simd_target(),
                             const Watch& watch = {});

}  // namespace mray
