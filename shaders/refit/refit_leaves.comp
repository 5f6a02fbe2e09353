// Writes the new positions of vertices to leaves, and their padded boxes to the slots of their
// parents.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "shaders/base/exact.glsl"

#include "common/interop/slab.h"
#include "shaders/refit/refit.glsl"

layout(binding = kBindPose) uniform usamplerBuffer positions;
layout(binding = kBindLeafVertices) uniform usamplerBuffer leaf_vertices;
layout(binding = kBindLeafParents) uniform usamplerBuffer leaf_parents;
layout(binding = kBindLeavesOut, r32ui) writeonly uniform uimageBuffer leaves_out;

void main() {
    if (gl_GlobalInvocationID.x >= args.count) return;
    uint leaf = args.first + gl_GlobalInvocationID.x;
    // All are fetched before the first is used, since each may be far away in memory.
    uvec3 bits[kLeafVertices];
    [[unroll]] for (uint quarter = 0u; quarter < kLeafVertices / 4u; ++quarter) {
        uvec4 vertices = texelFetch(leaf_vertices, int(leaf * kLeafVertices / 4u + quarter));
        [[unroll]] for (uint i = 0u; i < 4u; ++i) {
            bits[4u * quarter + i] = texelFetch(positions, int(vertices[i])).xyz;
        }
    }
    vec3 lower = vec3(kEmptyPlane);
    vec3 upper = vec3(-kEmptyPlane);
    [[unroll]] for (uint i = 0u; i < kLeafVertices; ++i) {
        int at = int(4u * (leaf * kLeafVec4s + i));
        imageStore(leaves_out, at, uvec4(bits[i].x));
        imageStore(leaves_out, at + 1, uvec4(bits[i].y));
        imageStore(leaves_out, at + 2, uvec4(bits[i].z));
        vec3 p = uintBitsToFloat(bits[i]);
        bool is_finite = p.x <= kSceneExtent;
        lower = is_finite ? min(lower, p) : lower;
        upper = is_finite ? max(upper, p) : upper;
    }
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
    store_box(texelFetch(leaf_parents, int(leaf)).x, lower, upper);
}
