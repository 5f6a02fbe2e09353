// Gives vertices their places between two keyframes.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/base/exact.glsl"

#include "common/interop/keyframes.h"
#include "shaders/kernel_interface.h"

layout(local_size_x = kGroupSize) in;

layout(push_constant) uniform Arguments { DeformArguments args; };
layout(binding = kBindKeyframes) uniform usamplerBuffer keyframes;
layout(binding = kBindPositionsOut, r32ui) writeonly uniform uimageBuffer positions_out;

vec3 keyframe_vertex(uint at) { return uintBitsToFloat(texelFetch(keyframes, int(at)).xyz); }

void main() {
    // Read before any control flow, in which lavapipe reads them lane by lane.
    float f = args.f;
    vec3 centre = args.centre;
    if (gl_GlobalInvocationID.x >= args.count) return;
    uint vertex = args.first + gl_GlobalInvocationID.x;
    uvec3 p = floatBitsToUint(between_keyframes(keyframe_vertex(args.before + vertex),
                                                keyframe_vertex(args.after + vertex), f, centre));
    int at = int(4u * vertex);
    imageStore(positions_out, at, uvec4(p.x));
    imageStore(positions_out, at + 1, uvec4(p.y));
    imageStore(positions_out, at + 2, uvec4(p.z));
}
