// Finds the closest hit of each camera ray of a region, one ray a lane.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/kernel.glsl"
#include "common/interop/camera.h"
#include "shaders/single_ray/visits.glsl"

layout(push_constant) uniform Arguments { RegionArguments args; };
layout(std430, binding = kBindHits) writeonly buffer Hits { Hit hits[]; };

void main() {
    uvec2 pixel = tile_pixel(args.tile_count, args.tile_columns);
    if (pixel.x >= args.width || pixel.y >= args.height) return;
    uint index = args.first + pixel.y * args.width + pixel.x;
    begin_ray(camera_ray(args.params.camera, args.x + pixel.x, args.y + pixel.y), false);
    traverse();
    hits[index] = closest_hit();
    end_ray(index);
}
