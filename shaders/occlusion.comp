// One secondary ray for each pixel that shows something: the shadow ray, or ambient-occlusion ray
// number args.sample_index. One ray a dispatch, because all loops of an invocation share one
// budget.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/exact.glsl"

#include "shaders/found_hits.glsl"
#include "shaders/pixel_surface.glsl"
#include "shaders/spread.glsl"
#include "shaders/traverse.glsl"
#include "shaders/work.glsl"

layout(local_size_x = kGroupSize) in;

layout(push_constant) uniform Arguments { OcclusionArguments args; };
layout(binding = kBindSeen) uniform usamplerBuffer seen;
layout(std430, binding = kBindOcclusion) buffer Occlusion { uint occlusion[]; };

void main() {
    uint i = args.seen_first +
             spread_group(gl_WorkGroupID.x, gl_NumWorkGroups.x) * kGroupSize +
             gl_LocalInvocationID.x;
    if (i >= args.seen_end) return;
    uint index = texelFetch(seen, int(i)).x;
    uint x = args.x + index % args.width;
    uint y = args.y + index / args.width;
    Hit hit = found_hit(index);
    Surface s = pixel_surface(camera_ray(args.params.camera, x, y), hit,
                              scene_triangle(hit.prim_id));
    bool is_shadow = args.params.rays == kRaysShadow;
    Ray ray = shadow_ray(s, args.params.light);
    if (!is_shadow) ray = ao_ray(s, x, y, args.sample_index, args.params.ao_tfar);
    bool is_traced = !is_shadow || faces_light(s, args.params.light);
    bool is_occluded = !is_traced;
    if (is_traced) {
        Traversal t = begin_traversal(ray);
        traverse(t, ray, true);
        is_occluded = t.best_prim != kNoPrim;
        report(t.status);
        if (!finished(t)) suspend(ray, index);
    }
    if (is_occluded) occlusion[index] += 1u;
}
