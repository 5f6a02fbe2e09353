// Crossings of half-lines that floats can decide (common/interop/winding_rule.h), one point a lane. The
// answer: winding, number of crossings. Up to pair_room uncertain ones are listed: point, triangle.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/kernel.glsl"
#include "common/interop/winding_rule.h"
#include "shaders/queries/visits.glsl"

READ4(Points, points, kBindRays);
layout(std430, binding = kBindPixels) writeonly buffer Pairs { uvec2 pairs[]; };

vec3 point;
uint point_index;

bool meets(vec3 lower, vec3 upper, out int key) {
    key = 0;
    return may_cross_in(point, lower, upper);
}

int last_key() { return 0; }

/// The order of the list depends on the schedule; its contents do not.
void list_uncertain(uint prim_id) {
    uint i = atomicAdd(work.header.visible_count, 1u);
    if (i < args.pair_room) pairs[i] = uvec2(point_index, prim_id);
}

uint test_triangle(vec3 a, vec3 b, vec3 c, uint prim_id) {
    if (!finite_vertices(a, b, c)) return 0u;
    FloatCrossing crossing = float_crossing(point, a, b, c);
    if (crossing.is_uncertain) list_uncertain(prim_id);
    if (!crossing.is_up && !crossing.is_down) return 0u;
    uint times = 1u + count_repeats(prim_id);
    answer.x += crossing.is_up ? times : 0u - times;
    answer.y += times;
    return kRepeatsSteps;
}

void main() {
    if (!find_query(point_index)) return;
    point = uintBitsToFloat(AT4(points, point_index).xyz);
    answer = uvec4(0u);
    answer_query(point_index);
}
