// How meshes wind around points (common/interop/winding_rule.h), one point a lane. The answer:
// winding, number of crossings, 1 for a point on the surface.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/base/exact.glsl"

#include "common/interop/winding_rule.h"
#include "shaders/kernel_interface.h"
#include "shaders/queries/question.glsl"

layout(binding = kBindRays) uniform usamplerBuffer points;

uvec4 answer;
vec3 point;

bool meets(vec3 lower, vec3 upper, out uint key) {
    key = 0u;
    return lower.x <= point.x && point.x <= upper.x && lower.y <= point.y && point.y <= upper.y &&
           point.z <= upper.z;
}

bool is_over(uint key) { return false; }

uint test_triangle(vec3 a, vec3 b, vec3 c, uint prim_id) {
    if (!finite_vertices(a, b, c)) return 0u;
    FloatCrossing crossing = float_crossing(point, a, b, c);
    uint crossed = crossing.is_up ? kCrossesUp : crossing.is_down ? kCrossesDown : 0u;
    uint steps = 0u;
    if (crossing.is_uncertain) {
        crossed = exact_crossing(point, a, b, c);
        steps = kExactCrossingSteps;
    }
    if (crossed == 0u) return steps;
    uint times = (crossed & (kCrossesUp | kCrossesDown)) != 0u ? 1u + count_repeats(prim_id) : 0u;
    answer.x += (crossed & kCrossesUp) != 0u ? times : 0u - times;
    answer.y += times;
    answer.z |= (crossed & kIsOnTriangle) != 0u ? 1u : 0u;
    return steps + kRepeatsSteps;
}

#include "shaders/queries/visits.glsl"

void main() {
    uint question;
    if (!find_question(question)) return;
    point = uintBitsToFloat(texelFetch(points, int(question)).xyz);
    answer = uvec4(0u);
    ask(question);
}
