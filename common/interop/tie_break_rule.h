// One owner for each crossing: which of the triangles around an edge or a vertex a ray crosses, if
// it goes through that edge or vertex. `intersect_triangle` counts all of them; questions that
// count crossings want one.
//
// The ray is moved by less than any distance: to P + (e, e^2) in the plane of projection, where P
// is (0, 0), for e -> 0 (H. Edelsbrunner, E. P. Mücke. Simulation of Simplicity. ACM TOG 9(1),
// 1990). The sign of an edge function of the projected vertices A and B is then that of
//     A.x * B.y - A.y * B.x,  where it is 0: A.y - B.y,  where it is 0: B.x - A.x.
// It is 0 only if A = B. All triangles see the same move. So exactly one of the two triangles at an
// edge of a closed mesh that the ray does not graze owns it, and a triangle whose projection has no
// area owns nothing (docs/design/arithmetic.md, "One owner").
#if !defined(COMMON_INTEROP_TIE_BREAK_RULE_H) || defined(SHARED_LANES)
#ifndef COMMON_INTEROP_TIE_BREAK_RULE_H
#define COMMON_INTEROP_TIE_BREAK_RULE_H

#include "common/interop/hit_rule.h"

#endif

SHARED_BEGIN

/// Whether the edge function of a and b, whose exact sign is that of e, is positive for the moved
/// ray. Checked: lab/proofs/tie_breaks.cpp.
SHARED Bool is_left_of_edge(Float e, Float3 a, Float3 b) {
    Bool tie = a.y > b.y || (a.y == b.y && b.x > a.x);
    return e > 0.0f || (e == 0.0f && tie);
}

/// Whether the moved ray goes through the triangle of three vertices from project(), with their
/// edge functions from exact_edges().
SHARED Bool owns_ray(Edges e, Float3 a, Float3 b, Float3 c) {
    Bool all_left =
        is_left_of_edge(e.u, b, c) && is_left_of_edge(e.v, c, a) && is_left_of_edge(e.w, a, b);
    Bool all_right =
        is_left_of_edge(-e.u, c, b) && is_left_of_edge(-e.v, a, c) && is_left_of_edge(-e.w, b, a);
    return all_left || all_right;
}

/// Returns false only if the ray of a hit goes through no edge and no vertex of the triangle: the
/// weight of an edge function that is 0 is at most kWeightRounding (docs/design/arithmetic.md).
SHARED Bool may_touch_border(Float u, Float v) {
    PRECISE Float rest = 1.0f - (u + v);
    return lesser(rest, lesser(u, v)) <= kWeightRounding;
}

#ifndef SHARED_LANES

/// Whether a triangle that a ray hits owns it, so that a ray crosses each edge and vertex in one
/// owner.
SHARED bool owns_hit(ShearedRay s, vec3 a, vec3 b, vec3 c, TriangleHit hit) {
    if (!may_touch_border(hit.u, hit.v)) return true;
    vec3 pa = project(s, a);
    vec3 pb = project(s, b);
    vec3 pc = project(s, c);
    return owns_ray(exact_edges(pa, pb, pc), pa, pb, pc);
}

#endif

SHARED_END

#endif  // per Float type
