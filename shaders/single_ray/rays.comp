// Finds the closest hit of each ray of a batch, one ray a lane.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/kernel.glsl"
#include "shaders/single_ray/traverse.glsl"

layout(push_constant) uniform Arguments { RaysArguments args; };
READ4(Rays, rays, kBindRays);
layout(std430, binding = kBindHits) writeonly buffer Hits { Hit hits[]; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= args.ray_count) return;
    Ray ray = ray_from(AT4(rays, 2u * i), AT4(rays, 2u * i + 1u));
    Traversal t = begin_traversal(ray);
    traverse(t, ray, false);
    hits[i] = closest_hit(t);
    report(t.status);
    if (!finished(t)) suspend(ray, i);
}
