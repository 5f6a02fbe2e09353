// The distance of a triangle from a point: a pure function of the two, which rounds in the same way
// everywhere.
//
// Vertices are taken relative to the point, rounded once. The answer is the nearest of four
// candidates: the closest point of each edge, and that of the triangle's inside. The regions are
// those of C. Ericson (Real-Time Collision Detection, 2005, 5.1.5). A candidate is a weighted mean
// of vertices without negative weights, so it is not nearer than the triangle, apart from rounding
// (docs/design/arithmetic.md, "Distances").
//
// - An edge or a vertex gives the same bits in all triangles that share it: the lowest prim_id of
//   them is the answer.
// - A point stays within the box of its edge or triangle, and rounding is monotone. So the distance
//   is not below that of any box around the triangle: a tree gives the answer of brute force.
// - No denormal decides anything: components below kTiny are taken for 0.
#if !defined(COMMON_INTEROP_CLOSEST_RULE_H) || defined(SHARED_LANES)
#ifndef COMMON_INTEROP_CLOSEST_RULE_H
#define COMMON_INTEROP_CLOSEST_RULE_H

#include "common/interop/arithmetic.h"
#include "common/interop/constants.h"

#endif

SHARED_BEGIN

SHARED Float zero_if_tiny(Float x, Float tiny) { return select(abs(x) < tiny, 0.0f, x); }

SHARED Float3 zero_if_tiny(Float3 p, Float tiny) {
    return Float3(zero_if_tiny(p.x, tiny), zero_if_tiny(p.y, tiny), zero_if_tiny(p.z, tiny));
}

SHARED Float3 scaled_by(Float3 p, Float scale) {
    PRECISE Float3 scaled = Float3(p.x * scale, p.y * scale, p.z * scale);
    return scaled;
}

/// The squared distance of a point from a box, as floats round: not above that of answers in it.
SHARED Float box_distance2(Float3 p, Float3 lower, Float3 upper) {
    PRECISE Float3 below = lower - p;
    PRECISE Float3 above = p - upper;
    Float3 zero3 = Float3(broadcast(0.0f), broadcast(0.0f), broadcast(0.0f));
    Float3 d = greater3(greater3(below, above), zero3);
    return dot3(d, d);
}

/// The closest point of the edge from a to b, all relative to the point asked about.
SHARED Float3 closest_on_edge(Float3 a, Float3 b) {
    // Triangles that share an edge find the same point of it.
    Bool is_swapped = b.x < a.x || (b.x == a.x && (b.y < a.y || (b.y == a.y && b.z < a.z)));
    Float3 p = select(is_swapped, b, a);
    Float3 q = select(is_swapped, a, b);
    PRECISE Float3 e = q - p;
    Float length2 = dot3(e, e);
    Float along = dot3(p, e);
    Bool is_edge = length2 > 0.0f;
    PRECISE Float at = -along * rcp_of_positive(select(is_edge, length2, 1.0f));
    Float clamped = lesser(greater(zero_if_tiny(at, broadcast(kTiny)), 0.0f), 1.0f);
    Float s = select(is_edge, clamped, 0.0f);
    PRECISE Float rest = 1.0f - s;
    PRECISE Float3 from_p = p + scaled_by(e, s);
    PRECISE Float3 from_q = q - scaled_by(e, rest);
    Float3 mean = select(s <= 0.5f, from_p, from_q);
    return zero_if_tiny(lesser3(greater3(mean, lesser3(p, q)), greater3(p, q)), broadcast(kTiny));
}

/// Whether the plane's closest point is inside the triangle a, b, c, and that point. Its place is
/// computed along the longest edge and, apart from that, along the triangle's height on that edge.
/// This keeps errors small for thin triangles ("Distances").
SHARED Bool closest_inside(Float3 a, Float3 b, Float3 c, OUT(Float3) point) {
    PRECISE Float3 ab = b - a;
    PRECISE Float3 bc = c - b;
    PRECISE Float3 ca = a - c;
    Float ab2 = dot3(ab, ab);
    Float bc2 = dot3(bc, bc);
    Float ca2 = dot3(ca, ca);
    Bool is_ab = ab2 >= bc2 && ab2 >= ca2;
    Bool is_bc = bc2 >= ca2;
    // The edge goes from p to q; r is the third corner.
    Float3 p = select(is_ab, a, select(is_bc, b, c));
    Float3 r = select(is_ab, c, select(is_bc, a, b));
    Float3 e = select(is_ab, ab, select(is_bc, bc, ca));
    Float length2 = select(is_ab, ab2, select(is_bc, bc2, ca2));
    PRECISE Float3 f = r - p;
    Float by_length2 = rcp_of_positive(select(length2 > 0.0f, length2, 1.0f));
    PRECISE Float along = -dot3(p, e) * by_length2;
    PRECISE Float r_along = dot3(f, e) * by_length2;
    PRECISE Float3 rest = f - scaled_by(e, r_along);
    Float3 height = zero_if_tiny(rest, broadcast(kTinyHeight));
    Float height2 = dot3(height, height);
    Bool is_any = height2 > 0.0f;
    PRECISE Float3 foot = p + scaled_by(e, along);
    PRECISE Float across = -dot3(zero_if_tiny(foot, broadcast(kTiny)), height) *
                           rcp_of_positive(select(is_any, height2, 1.0f));
    Float of_r = zero_if_tiny(across, broadcast(kTiny));
    PRECISE Float beyond = along - of_r * r_along;
    Float of_q = zero_if_tiny(beyond, broadcast(kTiny));
    PRECISE Float of_p = 1.0f - (of_q + of_r);
    Bool is_inside = is_any && lesser(of_r, lesser(of_q, of_p)) > 0.0f;
    // Weights that are not inside may be too large to go on with.
    Float of_a = select(is_inside, select(is_ab, of_p, select(is_bc, of_r, of_q)), 1.0f);
    Float of_b = select(is_inside, select(is_ab, of_q, select(is_bc, of_p, of_r)), 0.0f);
    Float of_c = select(is_inside, select(is_ab, of_r, select(is_bc, of_q, of_p)), 0.0f);
    PRECISE Float3 mean = (scaled_by(a, of_a) + scaled_by(b, of_b)) + scaled_by(c, of_c);
    Float3 lower = lesser3(a, lesser3(b, c));
    Float3 upper = greater3(a, greater3(b, c));
    point = zero_if_tiny(lesser3(greater3(mean, lower), upper), broadcast(kTiny));
    return is_inside;
}

/// The squared distance of p from the triangle a, b, c (scene space, finite). The distance is
/// within 2^-21 of that of the farthest corner from the exact one
/// (tests/common/interop/point_rules_test.cpp).
SHARED Float triangle_distance2(Float3 p, Float3 a, Float3 b, Float3 c) {
    PRECISE Float3 ra = a - p;
    PRECISE Float3 rb = b - p;
    PRECISE Float3 rc = c - p;
    Float3 on_ab = closest_on_edge(ra, rb);
    Float3 on_bc = closest_on_edge(rb, rc);
    Float3 on_ca = closest_on_edge(rc, ra);
    Float d2 = lesser(lesser(dot3(on_ab, on_ab), dot3(on_bc, on_bc)), dot3(on_ca, on_ca));
    Float3 inside;
    Bool is_inside = closest_inside(ra, rb, rc, inside);
    return select(is_inside, lesser(d2, dot3(inside, inside)), d2);
}

SHARED_END

#endif  // per Float type
