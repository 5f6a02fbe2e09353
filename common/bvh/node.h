// The nodes of a tree for scalars: children, and the boxes of slots; and the vertices of its
// leaves. For lanes see cpu/simd/node-inl.h, for devices shaders/tree.glsl.
#pragma once

#include <span>

#include "common/bvh/box.h"
#include "common/interop/bvh_layout.h"

namespace mray {

/// A value for each slot of a node.
template <class T>
using PerSlot = T[kWidth];

/// A value for each vertex, or each triangle, of a leaf.
template <class T>
using PerVertex = T[kLeafVertices];
template <class T>
using PerTriangle = T[kLeafTriangles];

/// Room for a depth-first traversal that pushes all children of a node.
template <class Entry>
using TraversalStack = Entry[kMaxStack];

inline constexpr std::uint32_t kNoParent = 0xFFFFFFFFu;

inline std::uint32_t child_of(const Node& node, std::uint32_t slot) { return node.child[slot]; }
inline void set_child(Node& node, std::uint32_t slot, std::uint32_t child) {
    node.child[slot] = child;
}

/// Calls use(slot, child) for each child entry of a node.
template <class Use>
void for_each_child(const Node& node, Use use) {
    for (std::uint32_t slot = 0; slot < kWidth && node.child[slot] != kEmptyChild; ++slot)
        use(slot, node.child[slot]);
}

/// plane_at() as a sum that cannot wrap, so that a known plane costs nothing.
inline std::size_t plane_place(std::uint32_t axis, std::uint32_t side, std::uint32_t slot) {
    return std::size_t{plane_at(2 * axis + side, 0)} + plane_at(0, slot);
}

/// The lower (side 0) or upper plane (side 1) of a slot's box.
inline float plane_of(const Node& node, std::uint32_t axis, std::uint32_t side,
                      std::uint32_t slot) {
    return node.planes[plane_place(axis, side, slot)];
}

inline Box slot_box(const Node& node, std::uint32_t slot) {
    return {{plane_of(node, 0, 0, slot), plane_of(node, 1, 0, slot), plane_of(node, 2, 0, slot)},
            {plane_of(node, 0, 1, slot), plane_of(node, 1, 1, slot), plane_of(node, 2, 1, slot)}};
}

inline void set_slot_box(Node& node, std::uint32_t slot, const Box& box) {
    for (std::uint32_t axis = 0; axis < 3; ++axis) {
        node.planes[plane_place(axis, 0, slot)] = box.lower[axis];
        node.planes[plane_place(axis, 1, slot)] = box.upper[axis];
    }
}

/// Makes the slots from `slot` on empty.
inline void clear_slots(Node& node, std::uint32_t slot) {
    for (; slot < kWidth; ++slot) {
        set_slot_box(node, slot, Box());
        set_child(node, slot, kEmptyChild);
    }
}

/// The union of a node's slots.
inline Box node_box(const Node& node) {
    Box box;
    for (std::uint32_t slot = 0; slot < kWidth; ++slot) box.extend(slot_box(node, slot));
    return box;
}

inline void set_parent_box(Node* nodes, std::uint32_t parent, const Box& box) {
    set_slot_box(nodes[parent_node(parent)], parent_slot(parent), box);
}

/// Gives the slot that is the parent of nodes[i] the union of its slots.
inline void unite_slots(std::span<Node> nodes, std::span<const std::uint32_t> parents,
                        std::size_t i) {
    set_parent_box(nodes.data(), parents[i], node_box(nodes[i]));
}

// A triangle of a leaf, as one number.
constexpr std::uint32_t triangle_at(std::uint32_t leaf, std::uint32_t slot) {
    return leaf * kLeafTriangles + slot;
}
constexpr std::uint32_t triangle_leaf(std::uint32_t triangle) { return triangle / kLeafTriangles; }
constexpr std::uint32_t triangle_slot(std::uint32_t triangle) { return triangle % kLeafTriangles; }

/// The place in Bvh::leaf_vertices of a leaf's vertices.
constexpr std::size_t vertices_at(std::size_t leaf) { return leaf * kLeafVertices; }

/// The vertices that the slots of a leaf take their positions from.
template <class Vertices>
auto vertices_of(Vertices&& leaf_vertices, std::size_t leaf) {
    return std::span(&leaf_vertices[vertices_at(leaf)], kLeafVertices);
}

}  // namespace mray
