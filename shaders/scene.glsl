// The triangles of the scene.
#ifndef SHADERS_SCENE_GLSL
#define SHADERS_SCENE_GLSL

#include "shaders/kernel_interface.h"

layout(binding = kBindPositions) uniform usamplerBuffer positions;
layout(binding = kBindTriangles) uniform usamplerBuffer triangles;

vec3 triangle_vertex(uint prim_id, uint i) {
    uint v = 3u * texelFetch(triangles, int(3u * prim_id + i)).x;
    return uintBitsToFloat(uvec3(texelFetch(positions, int(v)).x,
                                 texelFetch(positions, int(v + 1u)).x,
                                 texelFetch(positions, int(v + 2u)).x));
}

#endif  // SHADERS_SCENE_GLSL
