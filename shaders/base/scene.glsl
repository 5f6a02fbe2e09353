#include "shaders/base/buffers.glsl"
#include "shaders/base/positions.glsl"

READ4(Triangles, triangles, kBindTriangles);

/// Three vertices and the albedo.
uvec4 scene_triangle(uint prim_id) { return AT4(triangles, prim_id); }

vec3 scene_vertex(uint v) { return uintBitsToFloat(position_bits(v)); }
