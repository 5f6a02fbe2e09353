// Finds the closest hit of each ray of a batch, one ray a lane.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/kernel.glsl"
#include "shaders/single_ray/visits.glsl"

layout(push_constant) uniform Arguments { CountArguments args; };
READ4(Rays, rays, kBindRays);
layout(std430, binding = kBindHits) writeonly buffer Hits { Hit hits[]; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= args.count) return;
    begin_ray(ray_from(AT4(rays, 2u * i), AT4(rays, 2u * i + 1u)), false);
    traverse();
    hits[i] = closest_hit();
    end_ray(i);
}
