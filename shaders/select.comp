// Lists the pixels of a region that show something, so that the rays that start there run without
// gaps between them, and clears their count of occluded rays.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/exact.glsl"

#include "shaders/found_hits.glsl"
#include "shaders/region.glsl"

layout(std430, binding = kBindOcclusion) writeonly buffer Occlusion { uint occlusion[]; };
layout(std430, binding = kBindSeenOut) writeonly buffer Seen { uint seen[]; };
layout(std430, binding = kBindWork) buffer Work { WorkHeader header; } work;

void main() {
    uvec2 pixel = region_pixel();
    if (!within_region(pixel)) return;
    uint index = answer_index(pixel);
    occlusion[index] = 0u;
    // The order of the list depends on the schedule, the answers do not.
    if (found_hit(index).prim_id != kNoPrim) seen[atomicAdd(work.header.seen_count, 1u)] = index;
}
