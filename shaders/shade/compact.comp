// Lists the visible pixels of a region, so that secondary rays run without gaps. Clears the count
// of occluded rays of all pixels. The pixels of a tile stay together, in the order of its lanes.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/base/exact.glsl"

#include "shaders/base/found_hits.glsl"
#include "shaders/base/region.glsl"

layout(std430, binding = kBindOcclusion) writeonly buffer Occlusion { uint occlusion[]; };
layout(std430, binding = kBindVisiblePixelsOut) writeonly buffer VisiblePixels {
    uint visible_pixels[];
};
layout(std430, binding = kBindWork) buffer Work { WorkHeader header; } work;

/// The visible pixels of the tile, as bits, and their first place in the list.
shared uint tile_pixels[kGroupSize / 32u];
shared uint tile_begin;

void main() {
    // The camera rays are not all done, and the host will ask again.
    if (work.header.suspended_count != 0u) return;
    uint lane = gl_LocalInvocationID.x;
    if (lane < kGroupSize / 32u) tile_pixels[lane] = 0u;
    barrier();
    uvec2 pixel = region_pixel();
    uint index = answer_index(pixel);
    bool is_visible = within_region(pixel);
    if (is_visible) occlusion[index] = 0u;
    if (is_visible) is_visible = found_hit(index).prim_id != kNoPrim;
    uint bit = 1u << (lane & 31u);
    if (is_visible) atomicOr(tile_pixels[lane / 32u], bit);
    barrier();
    uint before = bitCount(tile_pixels[lane / 32u] & (bit - 1u));
    if (lane >= 32u) before += bitCount(tile_pixels[0]);
    // The order of tiles in the list depends on the schedule; the answers do not.
    if (lane == kGroupSize - 1u) {
        tile_begin = atomicAdd(work.header.visible_count, before + (is_visible ? 1u : 0u));
    }
    barrier();
    if (is_visible) visible_pixels[tile_begin + before] = index;
}
