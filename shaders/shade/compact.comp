// Lists the pixels of a region that show something, so that the rays that start there run without
// gaps between them, and clears their count of occluded rays. The pixels of a tile stay together, in
// the order of its lanes.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/base/exact.glsl"

#include "shaders/single_ray/found_hits.glsl"
#include "shaders/base/region.glsl"

layout(std430, binding = kBindOcclusion) writeonly buffer Occlusion { uint occlusion[]; };
layout(std430, binding = kBindSeenOut) writeonly buffer Seen { uint seen[]; };
layout(std430, binding = kBindWork) buffer Work { WorkHeader header; } work;

/// The pixels of the tile that show something, as bits, and where they begin in the list.
shared uint tile_pixels[kGroupSize / 32u];
shared uint tile_begin;

void main() {
    uint lane = gl_LocalInvocationID.x;
    if (lane < kGroupSize / 32u) tile_pixels[lane] = 0u;
    barrier();
    uvec2 pixel = region_pixel();
    uint index = answer_index(pixel);
    bool is_seen = within_region(pixel);
    if (is_seen) occlusion[index] = 0u;
    if (is_seen) is_seen = found_hit(index).prim_id != kNoPrim;
    uint bit = 1u << (lane & 31u);
    if (is_seen) atomicOr(tile_pixels[lane / 32u], bit);
    barrier();
    uint before = bitCount(tile_pixels[lane / 32u] & (bit - 1u));
    if (lane >= 32u) before += bitCount(tile_pixels[0]);
    // The order of tiles depends on the schedule, the answers do not.
    if (lane == kGroupSize - 1u) {
        tile_begin = atomicAdd(work.header.seen_count, before + (is_seen ? 1u : 0u));
    }
    barrier();
    if (is_seen) seen[tile_begin + before] = index;
}
