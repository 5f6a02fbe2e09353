// How often a closed mesh winds around a point: the crossings of the half-line from the point
// upwards (along +z) with the triangles, each +1 or -1 by the side that it leaves.
//
// Floats decide nearly all of it here. Exact integers on the host decide the rest
// (common/scene/exact_crossing.h), for the coordinates that the caller gave, from which those of
// scene space may differ by kCoordinateError. docs/design/arithmetic.md, "Inside".
#if !defined(COMMON_INTEROP_WINDING_RULE_H) || defined(SHARED_LANES)
#ifndef COMMON_INTEROP_WINDING_RULE_H
#define COMMON_INTEROP_WINDING_RULE_H

#include "common/interop/hit_rule.h"

SHARED_BEGIN

// The error of an edge function here, by the square of the sum of |x| + |y| over the vertices:
// 2^-23; and of a height by the sum of the edge functions: 2^-21.
SHARED_CONST float kWindingEdgeError = 1.1920928955078125e-07f;
SHARED_CONST float kWindingHeightError = 4.76837158203125e-07f;

SHARED_END

#endif

SHARED_BEGIN

/// A triangle as floats see it from a point: whether the half-line certainly crosses it, leaving
/// the side that it is counter-clockwise from (up) or the other one (down); and whether floats
/// cannot tell.
struct FloatCrossing {
    Bool is_up, is_down, is_uncertain;
};

/// Never wrong where it is not uncertain, for the point and the vertices before they were brought
/// into scene space; uncertain for every triangle that the point lies on. p is at most 2^21 on each
/// axis. Checked: lab/proofs/winding.g.
SHARED FloatCrossing float_crossing(Float3 p, Float3 a, Float3 b, Float3 c) {
    PRECISE Float3 ra = a - p;
    PRECISE Float3 rb = b - p;
    PRECISE Float3 rc = c - p;
    Float3 lower = lesser3(ra, lesser3(rb, rc));
    Float3 upper = greater3(ra, greater3(rb, rc));
    Bool is_beside = (lower.x > kCoordinateError || upper.x < -kCoordinateError) ||
                     (lower.y > kCoordinateError || upper.y < -kCoordinateError);
    Bool is_above = lower.z > kCoordinateError;
    Bool is_below = upper.z < -kCoordinateError;

    Float u = fast_edge(rb, rc);
    Float v = fast_edge(rc, ra);
    Float w = fast_edge(ra, rb);
    PRECISE Float sizes = (projected_size(ra) + projected_size(rb)) + projected_size(rc);
    PRECISE Float m = sizes + kCoordinateError;
    PRECISE Float bound = m * (kWindingEdgeError * m + kCoordinateError);
    Float least = lesser(u, lesser(v, w));
    Float most = greater(u, greater(v, w));
    Bool is_left = least > bound;
    Bool is_right = most < -bound;
    Bool is_outside = least < -bound && most > bound;

    // The height of the triangle above the point, times twice its projected area.
    PRECISE Float height = (u * ra.z + v * rb.z) + w * rc.z;
    PRECISE Float sum = (abs(u) + abs(v)) + abs(w);
    PRECISE Float size = greater(abs(upper.z), abs(lower.z)) + kCoordinateError;
    PRECISE Float error =
        (3.0f * bound + kWindingHeightError * sum) * size + kCoordinateError * sum;
    Bool is_positive = height > error;
    Bool is_negative = height < -error;
    FloatCrossing crossing;
    crossing.is_up = is_left && (is_above || is_positive);
    crossing.is_down = is_right && (is_above || is_negative);
    Bool is_under = (is_left && is_negative) || (is_right && is_positive);
    Bool is_missed = (is_beside || is_outside) || (is_below || is_under);
    crossing.is_uncertain = !(is_missed || (crossing.is_up || crossing.is_down));
    return crossing;
}

/// Whether float_crossing() may be anything but a miss for a triangle in this box. The differences
/// are not above, or not below, those of its vertices, because rounding is monotone.
SHARED Bool may_cross_in(Float3 p, Float3 lower, Float3 upper) {
    PRECISE Float3 below = lower - p;
    PRECISE Float3 above = upper - p;
    return (below.x <= kCoordinateError && above.x >= -kCoordinateError) &&
           (below.y <= kCoordinateError && above.y >= -kCoordinateError) &&
           above.z >= -kCoordinateError;
}

#ifndef SHARED_LANES

/// A point as float_crossing() takes it: one outside of scene space becomes one nearer to it with
/// the same crossings, since no vertex lies between the two on any axis.
SHARED vec3 clipped_point(vec3 p) {
    const float most = 2.0f * kSceneExtent;
    return vec3(lesser(greater(p.x, -most), most), lesser(greater(p.y, -most), most),
                lesser(greater(p.z, -most), most));
}

#endif

SHARED_END

#endif  // per Float type
