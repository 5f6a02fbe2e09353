// Finds the closest hit of each ray of a batch, one ray a lane.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/base/exact.glsl"

#include "shaders/single_ray/traverse.glsl"
#include "shaders/single_ray/work.glsl"

layout(local_size_x = kGroupSize) in;

layout(push_constant) uniform Arguments { RaysArguments args; };
READ4(Rays, rays, kBindRays);
layout(std430, binding = kBindHits) writeonly buffer Hits { Hit hits[]; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= args.ray_count) return;
    vec4 first = uintBitsToFloat(AT4(rays, 2u * i));
    vec4 second = uintBitsToFloat(AT4(rays, 2u * i + 1u));
    Ray ray;
    ray.org = first.xyz;
    ray.tnear = first.w;
    ray.dir = second.xyz;
    ray.tfar = second.w;
    Traversal t = begin_traversal(ray);
    traverse(t, ray, false);
    hits[i] = closest_hit(t);
    report(t.status);
    if (!finished(t)) suspend(ray, i);
}
