// Finds the normals and depths of a region's samples, which the shading of its pixels reads several times.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/kernel.glsl"
#include "shaders/shade/lit_samples.glsl"

layout(std430, binding = kBindSurfaces) writeonly buffer Surfaces { uvec4 surfaces[]; };

void main() {
    uint index = gl_GlobalInvocationID.x;
    if (index >= args.width * args.height) return;
    Hit hit = hit_from(AT4(found_hits, index));
    vec4 surface = vec4(0.0f, 0.0f, 0.0f, -1.0f);
    if (hit.prim_id != kNoPrim) {
        uvec2 place = place_in_image(index);
        vec3 through = camera_direction(camera_of_image(), place.x, place.y);
        Surface s = flat_surface(place, hit, corners_of(hit.prim_id));
        surface = vec4(s.normal, depth_of(hit.t, through));
    }
    surfaces[index] = floatBitsToUint(surface);
}
