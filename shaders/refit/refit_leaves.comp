// Writes the new positions of vertices to leaves, and their padded boxes to the slots of their
// parents.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/base/exact.glsl"

#include "common/interop/slab.h"
#include "shaders/base/positions.glsl"
#include "shaders/refit/refit.glsl"

READ1(LeafVertices, leaf_vertices, kBindLeafVertices);
READ1(LeafParents, leaf_parents, kBindLeafParents);

#ifdef STORAGE_BUFFERS
// Whole vectors, of which the last word stays, so that 16 lanes write 256 bytes in sequence.
layout(std430, binding = kBindLeafWords) buffer LeafWords { uvec4 leaf_vectors[]; };
void store_vertex(uint at, uvec3 bits) { leaf_vectors[at] = uvec4(bits, leaf_vectors[at].w); }
#else
layout(binding = kBindLeafWords, r32ui) writeonly uniform uimageBuffer leaf_words;
void store_vertex(uint at, uvec3 bits) {
    imageStore(leaf_words, int(4u * at), uvec4(bits.x));
    imageStore(leaf_words, int(4u * at + 1u), uvec4(bits.y));
    imageStore(leaf_words, int(4u * at + 2u), uvec4(bits.z));
}
#endif

void main() {
    uint leaf = refit_item();
    vec3 lower = vec3(kEmptyPlane);
    vec3 upper = vec3(-kEmptyPlane);
    if (is_within()) {
        uvec3 bits = position_bits(AT1(leaf_vertices, leaf * kLeafVertices + refit_lane()));
        store_vertex(leaf * kLeafVec4s + refit_lane(), bits);
        vec3 p = uintBitsToFloat(bits);
        bool is_finite = p.x <= kSceneExtent;
        lower = is_finite ? p : lower;
        upper = is_finite ? p : upper;
    }
    unite(lower, upper);
    if (!is_within()) return;
    // No pad for an empty box, which stays the neutral element of a union.
    if (lower.x <= upper.x) {
        float extent = largest_extent(lower, upper);
        precise vec3 below = lower - vec3(plane_pad(lower.x, extent), plane_pad(lower.y, extent),
                                          plane_pad(lower.z, extent));
        precise vec3 above = upper + vec3(plane_pad(upper.x, extent), plane_pad(upper.y, extent),
                                          plane_pad(upper.z, extent));
        lower = below;
        upper = above;
    }
    store_box(AT1(leaf_parents, leaf), lower, upper);
}
