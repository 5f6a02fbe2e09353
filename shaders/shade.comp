// From hits and occlusion to the pixels of a region.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/exact.glsl"

#include "common/interop/shade.h"
#include "shaders/found_hits.glsl"
#include "shaders/pixel_surface.glsl"
#include "shaders/region.glsl"

layout(binding = kBindFoundOcclusion) uniform usamplerBuffer found_occlusion;
layout(std430, binding = kBindPixels) writeonly buffer Pixels { uint pixels[]; };

void main() {
    uvec2 pixel = region_pixel();
    if (!within_region(pixel)) return;
    uint index = answer_index(pixel);
    uint y = args.y + pixel.y;
    uint colour = background(y, args.params.height);
    Hit hit = found_hit(index);
    if (hit.prim_id < kUnfinishedPrim) {
        Ray ray = camera_ray(args.params.camera, args.x + pixel.x, y);
        uvec4 triangle = scene_triangle(hit.prim_id);
        Surface s = pixel_surface(ray, hit, triangle);
        uint occluded = texelFetch(found_occlusion, int(index)).x;
        occluded = args.params.rays == kRaysPrimary ? 0u : occluded;
        colour = shade(args.params, ray, s, triangle.w, occluded);
    }
    pixels[index] = colour;
}
