// Gives leaves their vertices' new positions, and their parents' slots the new boxes.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "shaders/exact.glsl"

#include "shaders/refit.glsl"

layout(binding = kBindPositions) uniform usamplerBuffer positions;
layout(binding = kBindLeafVertices) uniform usamplerBuffer leaf_vertices;
layout(binding = kBindLeafParents) uniform usamplerBuffer leaf_parents;
layout(binding = kBindLeavesOut, r32ui) writeonly uniform uimageBuffer leaves_out;

void main() {
    if (gl_GlobalInvocationID.x >= args.count) return;
    uint leaf = args.first + gl_GlobalInvocationID.x;
    vec3 lower = vec3(kEmptyPlane);
    vec3 upper = vec3(-kEmptyPlane);
    [[unroll]] for (uint quarter = 0u; quarter < kLeafVertices / 4u; ++quarter) {
        uvec4 vertices = texelFetch(leaf_vertices, int(leaf * kLeafVertices / 4u + quarter));
        [[unroll]] for (uint i = 0u; i < 4u; ++i) {
            uvec3 bits = texelFetch(positions, int(vertices[i])).xyz;
            int at = int(4u * (leaf * kLeafVec4s + 4u * quarter + i));
            imageStore(leaves_out, at, uvec4(bits.x));
            imageStore(leaves_out, at + 1, uvec4(bits.y));
            imageStore(leaves_out, at + 2, uvec4(bits.z));
            vec3 p = uintBitsToFloat(bits);
            bool is_finite = p.x <= kSceneExtent;
            lower = is_finite ? min(lower, p) : lower;
            upper = is_finite ? max(upper, p) : upper;
        }
    }
    store_box(texelFetch(leaf_parents, int(leaf)).x, lower, upper);
}
