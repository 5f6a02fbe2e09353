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

// Sizes and offsets in uvec4s.
SHARED_CONST uint kNodeVec4s = 28u;
SHARED_CONST uint kNodeLowerX = 0u;
SHARED_CONST uint kNodeUpperX = 4u;
SHARED_CONST uint kNodeLowerY = 8u;
SHARED_CONST uint kNodeUpperY = 12u;
SHARED_CONST uint kNodeLowerZ = 16u;
SHARED_CONST uint kNodeUpperZ = 20u;
SHARED_CONST uint kNodeChild = 24u;
SHARED_CONST uint kLeafVec4s = 20u;
SHARED_CONST uint kLeafPrimIds = 16u;

// The most levels of nodes, and the stack of a depth-first traversal that pushes all children.
SHARED_CONST uint kMaxDepth = 16u;
SHARED_CONST uint kMaxStack = 241u;  // kMaxDepth * (kWidth - 1) + 1

/// 448 B. Slot i holds the box of child[i]; the box of an empty slot is inverted (kEmptyPlane).
/// Used slots come first.
struct Node {
    float lower_x[16];
    float upper_x[16];
    float lower_y[16];
    float upper_y[16];
    float lower_z[16];
    float upper_z[16];
    uint child[16];
};

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
static_assert(offsetof(Node, lower_x) == 16 * kNodeLowerX);
static_assert(offsetof(Node, upper_x) == 16 * kNodeUpperX);
static_assert(offsetof(Node, lower_y) == 16 * kNodeLowerY);
static_assert(offsetof(Node, upper_y) == 16 * kNodeUpperY);
static_assert(offsetof(Node, lower_z) == 16 * kNodeLowerZ);
static_assert(offsetof(Node, upper_z) == 16 * kNodeUpperZ);
static_assert(offsetof(Node, child) == 16 * kNodeChild);
static_assert(sizeof(Leaf) == 320 && sizeof(Leaf) == 16 * kLeafVec4s);
static_assert(offsetof(Leaf, prim_id) == 16 * kLeafPrimIds);
static_assert(kMaxStack == kMaxDepth * (kWidth - 1) + 1);
}  // namespace mray
#endif

#endif  // COMMON_INTEROP_BVH_LAYOUT_H
