// The triangles closest to points (common/interop/closest_rule.h), one point a lane. The answer: the
// bits of the squared distance, and the triangle; kNoPrim if none is as near as the point's fourth word.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/kernel.glsl"
#include "common/interop/closest_rule.h"
#include "common/interop/hit_rule.h"
#include "shaders/queries/visits.glsl"

READ4(Points, points, kBindRays);

vec3 point;

// The bits of floats that are not negative have the floats' order.

bool meets(vec3 lower, vec3 upper, out int key) {
    key = floatBitsToInt(box_distance2(point, lower, upper));
    return uint(key) <= answer.x;
}

int last_key() { return int(answer.x); }

uint test_triangle(vec3 a, vec3 b, vec3 c, uint prim_id) {
    if (!finite_vertices(a, b, c)) return 0u;
    uint d2 = floatBitsToUint(triangle_distance2(point, a, b, c));
    if (d2 < answer.x || (d2 == answer.x && prim_id < answer.y)) {
        answer.x = d2;
        answer.y = prim_id;
    }
    return 0u;
}

void main() {
    uint query;
    if (!find_query(query)) return;
    uvec4 words = AT4(points, query);
    point = uintBitsToFloat(words.xyz);
    answer = uvec4(words.w, kNoPrim, 0u, 0u);
    answer_query(query);
}
