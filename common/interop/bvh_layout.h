// The BVH layout of both backends: width 16, meshlet leaves of at most 16 triangles over at most 16
// vertices. lab/notes/build_and_refit.md has the figures behind the choice. On a device both arrays
// are read as texel buffers of uvec4, so all offsets are multiples of 16 B.
#ifndef COMMON_INTEROP_BVH_LAYOUT_H
#define COMMON_INTEROP_BVH_LAYOUT_H

#include "common/interop/constants.h"
#include "common/interop/platform.h"

SHARED_BEGIN

SHARED_CONST uint kWidth = 16u;
SHARED_CONST uint kLeafTriangles = 16u;
SHARED_CONST uint kLeafVertices = 16u;

// child[]: kLeafBit | leaf index, or a node index, or kEmptyChild.
SHARED_CONST uint kLeafBit = 0x80000000u;
SHARED_CONST uint kEmptyChild = 0xFFFFFFFFu;

// From each plane of a node to the next, in floats.
SHARED_CONST uint kPlaneStride = kWidth;

// Sizes and offsets in uvec4s.
SHARED_CONST uint kNodeVec4s = 28u;
SHARED_CONST uint kNodeChild = 24u;
SHARED_CONST uint kLeafVec4s = 20u;
SHARED_CONST uint kLeafPrimIds = 16u;

// The most levels of nodes, and the stack of a depth-first traversal that pushes all children.
SHARED_CONST uint kMaxDepth = 16u;
SHARED_CONST uint kMaxStack = 241u;  // kMaxDepth * (kWidth - 1) + 1

/// 448 B. Slot i holds the box of child[i], in planes that plane_at() finds; that of an empty slot
/// is inverted (kEmptyPlane). Used slots come first. What reads nodes: common/bvh/node.h,
/// cpu/simd/node-inl.h, shaders/tree.glsl.
struct Node {
    float planes[96];
    uint child[16];
};

/// The place in Node::planes of a slot's plane: a sum of a part of each. plane: 2 * axis, and 1
/// more for the upper ones.
SHARED uint plane_at(uint plane, uint slot) { return plane * kPlaneStride + slot; }

// Child entries. is_leaf() is true for kEmptyChild, too.
SHARED bool is_leaf(uint child) { return (child & kLeafBit) != 0u; }
SHARED uint leaf_of(uint child) { return child & ~kLeafBit; }
SHARED uint leaf_child(uint leaf) { return kLeafBit | leaf; }

// A parent is a slot of a node, as one number.
SHARED uint parent_at(uint node, uint slot) { return node * kWidth + slot; }
SHARED uint parent_node(uint parent) { return parent / kWidth; }
SHARED uint parent_slot(uint parent) { return parent % kWidth; }

/// A vertex of a leaf in scene space. corners belongs not to this vertex but to the leaf's triangle
/// in the same slot: its local vertex indices as packed by pack_corners.
struct LeafVertex {
    float x, y, z;
    uint corners;
};

/// 320 B. Triangle i joins vertex slots corner(vertex[i].corners, 0..2) and has id prim_id[i],
/// which is kNoPrim in unused slots; used slots come first, in ascending prim_id. Unused vertex
/// slots repeat slot 0.
struct Leaf {
    LeafVertex vertex[16];
    uint prim_id[16];
};

/// Packs a triangle's vertices (slots of its leaf) and the leaf's number of triangles.
SHARED uint pack_corners(uint a, uint b, uint c, uint triangle_count) {
    return a | (b << 8u) | (c << 16u) | (triangle_count << 24u);
}
SHARED uint corner(uint corners, uint i) { return (corners >> (8u * i)) & 0xFFu; }
SHARED uint corner_triangle_count(uint corners) { return corners >> 24u; }

SHARED_END

#ifdef __cplusplus
#include <cstddef>
namespace mray {

static_assert(sizeof(Node) == 448 && sizeof(Node) == 16 * kNodeVec4s);
static_assert(offsetof(Node, planes) == 0 && sizeof(Node::planes) == 6 * sizeof(float) * kWidth);
static_assert(offsetof(Node, child) == 16 * kNodeChild);
static_assert(sizeof(Leaf) == 320 && sizeof(Leaf) == 16 * kLeafVec4s);
static_assert(offsetof(Leaf, prim_id) == 16 * kLeafPrimIds);
static_assert(kMaxStack == kMaxDepth * (kWidth - 1) + 1);
}  // namespace mray
#endif

#endif  // COMMON_INTEROP_BVH_LAYOUT_H
