// The nodes and leaves of the tree (common/interop/bvh_layout.h), four slots of a node at a time, and the
// hit rule for a triangle of a leaf. For the host see common/bvh/node.h.
#ifndef SHADERS_TREE_GLSL
#define SHADERS_TREE_GLSL

#include "common/interop/hit_rule.h"

READ4_IN_PLACE(Nodes, nodes, kBindNodes);
READ4_IN_PLACE(Leaves, leaves, kBindLeaves);

// From each plane of a node to the next, in vectors.
const uint kPlaneVec4s = kPlaneStride / 4u;

/// Where the slots from 4 * quarter on have their first plane; plane p is p * kPlaneVec4s on.
uint quarter_at(uint node, uint quarter) {
    return node * kNodeVec4s + quarter * (plane_at(0u, 4u) / 4u);
}

vec4 four_planes(uint node, uint quarter, uint axis, uint side) {
    uint plane = 2u * axis + side;
    return uintBitsToFloat(AT4_IN_PLACE(nodes, quarter_at(node, quarter) + plane * kPlaneVec4s));
}

uvec4 four_children(uint node, uint quarter) {
    return AT4_IN_PLACE(nodes, node * kNodeVec4s + kNodeChild + quarter);
}

uint leaf_triangle_count(uint leaf) {
    return corner_triangle_count(AT4_IN_PLACE(leaves, leaf * kLeafVec4s).w);
}

vec3 leaf_vertex(uint leaf, uint slot) {
    return uintBitsToFloat(AT4_IN_PLACE(leaves, leaf * kLeafVec4s + slot).xyz);
}

void leaf_triangle(uint leaf, uint i, out vec3 a, out vec3 b, out vec3 c) {
    uint indices = AT4_IN_PLACE(leaves, leaf * kLeafVec4s + i).w;
    a = leaf_vertex(leaf, corner(indices, 0u));
    b = leaf_vertex(leaf, corner(indices, 1u));
    c = leaf_vertex(leaf, corner(indices, 2u));
}

uint leaf_prim(uint leaf, uint i) {
    return AT4_IN_PLACE(leaves, leaf * kLeafVec4s + kLeafPrimIds + i / 4u)[i % 4u];
}

/// Makes a hit the answer, bits of t, u and v and the triangle, if it is closer.
void take_if_closer(TriangleHit hit, uint prim_id, inout uvec4 answer) {
    if (!is_closer(hit.t, prim_id, uintBitsToFloat(answer.x), answer.w)) return;
    answer = uvec4(floatBitsToUint(hit.t), floatBitsToUint(hit.u), floatBitsToUint(hit.v), prim_id);
}

/// The whole rule.
void decide_triangle(ShearedRay sheared, float tnear, uint leaf, uint i, inout uvec4 answer) {
    vec3 a, b, c;
    leaf_triangle(leaf, i, a, b, c);
    TriangleHit hit;
    if (intersect_triangle(sheared, tnear, uintBitsToFloat(answer.x), a, b, c, hit))
        take_if_closer(hit, leaf_prim(leaf, i), answer);
}

#endif  // SHADERS_TREE_GLSL
