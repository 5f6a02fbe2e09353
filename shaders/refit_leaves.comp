// Gives leaves their vertices' new positions, and their parents' slots the new boxes.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/exact.glsl"

#include "shaders/refit.glsl"

layout(binding = kBindLeaves) uniform usamplerBuffer leaves;
layout(binding = kBindPositions) uniform usamplerBuffer positions;
layout(binding = kBindLeafVertices) uniform usamplerBuffer leaf_vertices;
layout(binding = kBindLeafParents) uniform usamplerBuffer leaf_parents;
layout(binding = kBindLeavesOut, rgba32ui) writeonly uniform uimageBuffer leaves_out;

void main() {
    if (gl_GlobalInvocationID.x >= args.count) return;
    uint leaf = args.first + gl_GlobalInvocationID.x;
    vec3 lower = vec3(kEmptyPlane);
    vec3 upper = vec3(-kEmptyPlane);
    for (uint slot = 0u; slot < kLeafVertices; ++slot) {
        uint v = 3u * texelFetch(leaf_vertices, int(leaf * kLeafVertices + slot)).x;
        uvec3 bits = uvec3(texelFetch(positions, int(v)).x, texelFetch(positions, int(v + 1u)).x,
                           texelFetch(positions, int(v + 2u)).x);
        int at = int(leaf * kLeafVec4s + slot);
        // Read and written by this lane alone, the write after the read that it depends on.
        imageStore(leaves_out, at, uvec4(bits, texelFetch(leaves, at).w));
        vec3 p = uintBitsToFloat(bits);
        bool is_finite = p.x <= kSceneExtent;
        lower = is_finite ? min(lower, p) : lower;
        upper = is_finite ? max(upper, p) : upper;
    }
    store_box(texelFetch(leaf_parents, int(leaf)).x, lower, upper);
}
