// The triangles of a leaf.
#ifndef SHADERS_BASE_LEAF_GLSL
#define SHADERS_BASE_LEAF_GLSL

#include "shaders/kernel_interface.h"

layout(binding = kBindLeaves, rgba32ui) uniform readonly uimageBuffer leaves;

// `leaf_at` is the index of a leaf times kLeafVec4s.

vec3 leaf_vertex(uint leaf_at, uint slot) {
    return uintBitsToFloat(imageLoad(leaves, int(leaf_at + slot)).xyz);
}

void leaf_triangle(uint leaf_at, uint i, out vec3 a, out vec3 b, out vec3 c) {
    uint indices = imageLoad(leaves, int(leaf_at + i)).w;
    a = leaf_vertex(leaf_at, corner(indices, 0u));
    b = leaf_vertex(leaf_at, corner(indices, 1u));
    c = leaf_vertex(leaf_at, corner(indices, 2u));
}

uint leaf_prim(uint leaf_at, uint i) {
    return imageLoad(leaves, int(leaf_at + kLeafPrimIds + i / 4u))[i % 4u];
}

#endif  // SHADERS_BASE_LEAF_GLSL
