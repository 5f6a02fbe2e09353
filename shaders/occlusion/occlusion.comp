// Traces secondary rays of visible pixels, one a lane: shadow or ambient-occlusion rays.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/kernel.glsl"
#include "common/interop/camera.h"
#include "common/interop/surface.h"
#include "shaders/corners.glsl"
#include "shaders/single_ray/visits.glsl"

layout(push_constant) uniform Arguments { OcclusionArguments args; };
READ4(FoundHits, found_hits, kBindFoundHits);
READ1(VisiblePixels, visible_pixels, kBindVisiblePixels);
layout(std430, binding = kBindOcclusion) buffer Occlusion { uint occlusion[]; };

void main() {
    uint i = args.ray_first +
             spread_group(gl_WorkGroupID.x, gl_NumWorkGroups.x) * kGroupSize +
             gl_LocalInvocationID.x;
    bool is_shadow = args.params.rays == kRaysShadow;
    uint samples = is_shadow ? 1u : args.params.ao_count;
    if (i >= min(args.ray_end, work.header.visible_count * samples)) return;
    uint index = AT1(visible_pixels, i / samples);
    uint x = args.x + index % args.width;
    uint y = args.y + index / args.width;
    Hit hit = hit_from(AT4(found_hits, index));
    Corners v = corners_of(hit.prim_id);
    Surface s = surface_at(camera_ray(args.params.camera, x, y), hit, v.a, v.b, v.c);
    Ray secondary = shadow_ray(s, args.params.light);
    if (!is_shadow) secondary = ao_ray(s, x, y, i % samples, args.params.ao_tfar);
    bool is_traced = !is_shadow || faces_light(s, args.params.light);
    bool is_occluded = !is_traced;
    if (is_traced) {
        begin_ray(secondary, true);
        traverse();
        is_occluded = has_hit();
        end_ray(index);
    }
    if (is_occluded) atomicAdd(occlusion[index], 1u);
}
