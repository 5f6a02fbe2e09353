// The triangles of the scene.
#ifndef SHADERS_SCENE_GLSL
#define SHADERS_SCENE_GLSL

#include "shaders/kernel_interface.h"

layout(binding = kBindPositions) uniform usamplerBuffer positions;
layout(binding = kBindTriangles) uniform usamplerBuffer triangles;

/// Three vertices and the albedo.
uvec4 scene_triangle(uint prim_id) { return texelFetch(triangles, int(prim_id)); }

vec3 scene_vertex(uint v) { return uintBitsToFloat(texelFetch(positions, int(v)).xyz); }

#endif  // SHADERS_SCENE_GLSL
