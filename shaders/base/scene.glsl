// The triangles of the scene.
#ifndef SHADERS_BASE_SCENE_GLSL
#define SHADERS_BASE_SCENE_GLSL

#include "shaders/kernel_interface.h"

layout(binding = kBindPositions, rgba32ui) uniform readonly uimageBuffer positions;
layout(binding = kBindTriangles, rgba32ui) uniform readonly uimageBuffer triangles;

/// Three vertices and the albedo.
uvec4 scene_triangle(uint prim_id) { return imageLoad(triangles, int(prim_id)); }

vec3 scene_vertex(uint v) { return uintBitsToFloat(imageLoad(positions, int(v)).xyz); }

#endif  // SHADERS_BASE_SCENE_GLSL
