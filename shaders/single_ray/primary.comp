// Finds the closest hit of each camera ray of a region, one ray a lane.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/base/exact.glsl"

#include "common/interop/camera.h"
#include "shaders/base/region.glsl"
#include "shaders/single_ray/traverse.glsl"
#include "shaders/single_ray/work.glsl"

layout(std430, binding = kBindHits) writeonly buffer Hits { Hit hits[]; };

void main() {
    uvec2 pixel = region_pixel();
    if (!within_region(pixel)) return;
    Ray ray = camera_ray(args.params.camera, args.x + pixel.x, args.y + pixel.y);
    Traversal t = begin_traversal(ray);
    traverse(t, ray, false);
    hits[answer_index(pixel)] = closest_hit(t);
    report(t.status);
    if (!finished(t)) suspend(ray, answer_index(pixel));
}
