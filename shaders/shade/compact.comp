// Lists the visible pixels of a region, so that secondary rays run without gaps. Clears the counts
// of occluded rays of all pixels, or moves them up. The pixels of a tile stay together, in the order of its lanes.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/kernel.glsl"

layout(push_constant) uniform Arguments { RegionArguments args; };
READ4(FoundHits, found_hits, kBindFoundHits);
layout(std430, binding = kBindOcclusion) buffer Occlusion { uint occlusion[]; };
layout(std430, binding = kBindVisiblePixelsOut) writeonly buffer VisiblePixels {
    uint visible_pixels[];
};
layout(std430, binding = kBindWork) buffer Work { WorkHeader header; } work;

/// The visible pixels of the tile, as bits, and the index of the first in the list.
shared uint tile_pixels[kGroupSize / 32u];
shared uint tile_begin;

void main() {
    // Another list follows: that of camera rays has been decided.
    if (gl_GlobalInvocationID.x == 0u) work.header.open_count = 0u;
    // Some camera rays are suspended: the host finishes them and submits this again.
    if (work.header.suspended_count != 0u) return;
    uint lane = gl_LocalInvocationID.x;
    if (lane < kGroupSize / 32u) tile_pixels[lane] = 0u;
    barrier();
    uvec2 pixel = tile_pixel(args.tile_count, args.tile_columns);
    uint index = pixel.y * args.width + pixel.x;
    bool is_visible = pixel.x < args.width && pixel.y < args.height;
    if (is_visible) occlusion[index] = args.first == 0u ? 0u : occlusion[index] << args.first;
    if (is_visible) is_visible = AT4(found_hits, index).w != kNoPrim;
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
