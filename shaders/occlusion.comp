// One secondary ray for each pixel of a region that shows something: the shadow ray, or ambient-
// occlusion ray number args.sample_index. One ray a dispatch, because all loops of an invocation
// share one budget.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/exact.glsl"

#include "shaders/pixel_surface.glsl"
#include "shaders/region.glsl"
#include "shaders/traverse.glsl"
#include "shaders/work.glsl"

layout(std430, binding = kBindHits) readonly buffer Hits { Hit hits[]; };
layout(std430, binding = kBindOcclusion) buffer Occlusion { uint occlusion[]; };

void main() {
    uvec2 pixel = region_pixel();
    if (!within_region(pixel)) return;
    uint index = answer_index(pixel);
    uint before = args.sample_index == 0u ? 0u : occlusion[index];
    uint occluded = 0u;
    Hit hit = hits[index];
    if (hit.prim_id != kNoPrim) {
        uint x = args.x + pixel.x;
        uint y = args.y + pixel.y;
        Surface s = pixel_surface(camera_ray(args.params.camera, x, y), hit,
                                  scene_triangle(hit.prim_id));
        bool is_shadow = args.params.rays == kRaysShadow;
        Ray ray = shadow_ray(s, args.params.light);
        if (!is_shadow) ray = ao_ray(s, x, y, args.sample_index, args.params.ao_tfar);
        if (is_shadow && !faces_light(s, args.params.light)) {
            occluded = 1u;
        } else {
            Traversal t = begin_traversal(ray);
            traverse(t, ray, true);
            occluded = t.best_prim != kNoPrim ? 1u : 0u;
            report(t.status);
            if (!finished(t)) suspend(ray, index);
        }
    }
    occlusion[index] = before + occluded;
}
