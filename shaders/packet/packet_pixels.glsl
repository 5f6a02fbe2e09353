// The pixels of a packet's rays, within the region that is traced.
#ifndef SHADERS_PACKET_PACKET_PIXELS_GLSL
#define SHADERS_PACKET_PACKET_PIXELS_GLSL

#include "shaders/packet/packet.glsl"

uvec2 packet_origin;  // the first pixel, within the region

// Copies of arguments: some devices read those lane by lane in divergent control flow.
uvec2 region_origin;
uvec2 region_size;

/// The pixel of this lane's ray in vector v.
uvec2 ray_pixel(uint v) {
    return packet_origin +
           uvec2(4u * (v & 3u) + (lane & 3u), kVectorHeight * (v >> 2u) + (lane >> 2u));
}

bool is_active(uvec2 pixel) { return pixel.x < region_size.x && pixel.y < region_size.y; }

uint answer_index(uvec2 pixel) { return pixel.y * region_size.x + pixel.x; }

#endif  // SHADERS_PACKET_PACKET_PIXELS_GLSL
