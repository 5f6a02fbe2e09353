// Moves rest positions of bodies by matrices into scene space, with the bits of the host.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/kernel.glsl"
#include "common/interop/transform.h"

layout(push_constant) uniform Arguments { CountArguments args; };

READ3(RestPositions, rest_positions, kBindRestPositions);
READ4(Bodies, bodies, kBindBodies);

#ifdef STORAGE_BUFFERS
layout(std430, binding = kBindMovedPositions) writeonly buffer MovedPositions { uint moved_words[]; };
void store_position(uint vertex, uvec3 bits) {
    for (uint k = 0u; k < 3u; ++k) moved_words[3u * vertex + k] = bits[k];
}
#else
layout(binding = kBindMovedPositions, rgba32ui) writeonly uniform uimageBuffer moved_positions;
void store_position(uint vertex, uvec3 bits) {
    imageStore(moved_positions, int(vertex), uvec4(bits, 0u));
}
#endif

uvec4 body_vector(uint body, uint k) { return AT4(bodies, body * kBodyVec4s + k); }

/// The body of the workgroup: the last one whose first group is not beyond it.
uint body_of_group() {
    uint body = 0u;
    uint end = args.count;
    while (end - body > 1u) {
        uint middle = (body + end) / 2u;
        bool is_beyond = body_vector(middle, kBodyRange).z > gl_WorkGroupID.x;
        body = is_beyond ? body : middle;
        end = is_beyond ? middle : end;
    }
    return body;
}

void main() {
    if (args.count == 0u) return;
    uint body = body_of_group();
    uvec4 range = body_vector(body, kBodyRange);
    vec4 space = uintBitsToFloat(body_vector(body, kBodySpace));
    Transform transform = Transform(uintBitsToFloat(body_vector(body, 0u)),
                                    uintBitsToFloat(body_vector(body, 1u)),
                                    uintBitsToFloat(body_vector(body, 2u)));
    uint begin = range.x + (gl_WorkGroupID.x - range.z) * kBodyGroupVertices;
    uint end = min(begin + kBodyGroupVertices, range.y);
    for (uint vertex = begin + gl_LocalInvocationID.x; vertex < end; vertex += kGroupSize) {
        vec3 world = transform_point(transform, uintBitsToFloat(AT3(rest_positions, vertex)));
        precise vec3 scaled = (world - space.xyz) * space.w;
        store_position(vertex, floatBitsToUint(snap_point(scaled)));
    }
}
