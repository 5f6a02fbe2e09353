// The hit rule for a triangle of a leaf, and the records of rays that other kernels go on with.
#include "common/interop/hit_rule.h"
#include "common/interop/slab.h"
#include "shaders/tree.glsl"

layout(std430, binding = kBindWork) buffer Work {
    WorkHeader header;
    Suspended suspended[];
} work;

/// The record of open ray i: they fill the list from its end.
uint open_record(uint i) { return uint(work.suspended.length()) - 1u - i; }

/// Makes a hit the answer, bits of t, u and v and the triangle, if it is closer.
void take_if_closer(TriangleHit hit, uint prim_id, inout uvec4 answer) {
    if (!is_closer(hit.t, prim_id, uintBitsToFloat(answer.x), answer.w)) return;
    answer = uvec4(floatBitsToUint(hit.t), floatBitsToUint(hit.u), floatBitsToUint(hit.v), prim_id);
}

/// The whole rule.
void decide_triangle(ShearedRay sheared, float tnear, uint leaf, uint i, inout uvec4 answer) {
    vec3 a, b, c;
    leaf_triangle(leaf, i, a, b, c);
    TriangleHit hit;
    if (intersect_triangle(sheared, tnear, uintBitsToFloat(answer.x), a, b, c, hit))
        take_if_closer(hit, leaf_prim(leaf, i), answer);
}
