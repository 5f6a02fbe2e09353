// How often a closed mesh winds around a point: the crossings of the half-line from the point
// upwards (along +z of scene space) with the triangles, each +1 or -1 by the side that it leaves.
//
// Exact for the floats of scene space. The half-line is moved by less than any distance, as is the
// point: to p + (e, e^2, e^3), e -> 0 (H. Edelsbrunner, E. P. Mücke. Simulation of Simplicity. ACM
// TOG 9(1), 1990). So an edge or a vertex is crossed in one triangle, and a point on the surface
// has an answer, too: that of its moved neighbour. All signs are those of determinants of
// differences of coordinates. Plain floats with a bound decide nearly all, integers the rest
// (docs/design/arithmetic.md, "Inside").
#if !defined(COMMON_INTEROP_WINDING_RULE_H) || defined(SHARED_LANES)
#ifndef COMMON_INTEROP_WINDING_RULE_H
#define COMMON_INTEROP_WINDING_RULE_H

#include "common/interop/exact_integer.h"
#include "common/interop/hit_rule.h"

#endif

SHARED_BEGIN

/// A triangle as floats see it from a point: whether the half-line certainly crosses it, leaving
/// the side that it is counter-clockwise from or the other one; and whether floats cannot tell.
struct FloatCrossing {
    Bool is_up;
    Bool is_down;
    Bool is_uncertain;
};

/// Never wrong where it is not uncertain; uncertain for every triangle that the point lies on.
/// Checked: proofs/winding.g.
SHARED FloatCrossing float_crossing(Float3 p, Float3 a, Float3 b, Float3 c) {
    PRECISE Float3 ra = a - p;
    PRECISE Float3 rb = b - p;
    PRECISE Float3 rc = c - p;
    Float highest = greater(ra.z, greater(rb.z, rc.z));
    Float lowest = lesser(ra.z, lesser(rb.z, rc.z));
    // The sign of a difference is exact.
    Bool is_beside = highest < 0.0f || lesser(ra.x, lesser(rb.x, rc.x)) > 0.0f ||
                     greater(ra.x, greater(rb.x, rc.x)) < 0.0f ||
                     lesser(ra.y, lesser(rb.y, rc.y)) > 0.0f ||
                     greater(ra.y, greater(rb.y, rc.y)) < 0.0f;
    Float u = fast_edge(rb, rc);
    Float v = fast_edge(rc, ra);
    Float w = fast_edge(ra, rb);
    PRECISE Float m = (projected_size(ra) + projected_size(rb)) + projected_size(rc);
    PRECISE Float bound = kWindingEdgeError * (m * m);
    Float least = lesser(u, lesser(v, w));
    Float most = greater(u, greater(v, w));
    Bool is_left = least > bound;
    Bool is_right = most < -bound;
    Bool is_outside = least < -bound && most > bound;

    // The height of the triangle above the point, times twice its projected area.
    PRECISE Float height = (u * ra.z + v * rb.z) + w * rc.z;
    PRECISE Float sum = (abs(u) + abs(v)) + abs(w);
    PRECISE Float error =
        (3.0f * bound + kWindingHeightError * sum) * greater(abs(highest), abs(lowest));
    Bool is_positive = height > error;
    Bool is_negative = height < -error;
    Bool is_up = is_left && (lowest > 0.0f || is_positive);
    Bool is_down = is_right && (lowest > 0.0f || is_negative);
    Bool is_below = (is_left && is_negative) || (is_right && is_positive);
    Bool is_decided = (is_beside || is_outside) || (is_below || (is_up || is_down));
    FloatCrossing crossing;
    crossing.is_up = is_up;
    crossing.is_down = is_down;
    crossing.is_uncertain = !is_decided;
    return crossing;
}

#ifndef SHARED_LANES

SHARED_CONST uint kCrossesUp = 1u;
SHARED_CONST uint kCrossesDown = 2u;
SHARED_CONST uint kIsOnTriangle = 4u;

struct ExactPoint {
    ExactInteger x;
    ExactInteger y;
    ExactInteger z;
};

SHARED ExactPoint exact_offset(vec3 from, vec3 to) {
    ExactPoint p;
    p.x = exact_difference(exact_coordinate(to.x), exact_coordinate(from.x));
    p.y = exact_difference(exact_coordinate(to.y), exact_coordinate(from.y));
    p.z = exact_difference(exact_coordinate(to.z), exact_coordinate(from.z));
    return p;
}

SHARED ExactInteger exact_minor(ExactInteger ax, ExactInteger ay, ExactInteger bx,
                                ExactInteger by) {
    return exact_difference(exact_product(ax, by), exact_product(ay, bx));
}

/// The cross product of two points.
SHARED ExactPoint exact_cross(ExactPoint a, ExactPoint b) {
    ExactPoint n;
    n.x = exact_minor(a.y, a.z, b.y, b.z);
    n.y = exact_minor(a.z, a.x, b.z, b.x);
    n.z = exact_minor(a.x, a.y, b.x, b.y);
    return n;
}

/// The sign of the edge function of a and b, which is `sign`, for the moved point.
SHARED int moved_edge_sign(int sign, vec3 a, vec3 b) {
    if (sign != 0) return sign;
    if (a.y != b.y) return a.y > b.y ? 1 : -1;
    if (a.x != b.x) return b.x > a.x ? 1 : -1;
    return 0;
}

/// Whether some of three signs are opposite.
SHARED bool any_opposite(int a, int b, int c) {
    bool any_positive = a > 0 || b > 0 || c > 0;
    bool any_negative = a < 0 || b < 0 || c < 0;
    return any_positive && any_negative;
}

SHARED bool is_between(float x, float a, float b, float c) {
    return x >= lesser(a, lesser(b, c)) && x <= greater(a, greater(b, c));
}

/// Whether the half-line from p crosses the triangle: kCrossesUp, kCrossesDown or neither, and
/// kIsOnTriangle if p is on the triangle, which has a border. Vertices are finite; p is at most
/// 2^21 on each axis.
SHARED uint exact_crossing(vec3 p, vec3 a, vec3 b, vec3 c) {
    ExactPoint ra = exact_offset(p, a);
    ExactPoint rb = exact_offset(p, b);
    ExactPoint rc = exact_offset(p, c);
    ExactPoint u = exact_cross(rb, rc);
    ExactPoint v = exact_cross(rc, ra);
    ExactPoint w = exact_cross(ra, rb);
    int uz = exact_sign(u.z);
    int vz = exact_sign(v.z);
    int wz = exact_sign(w.z);
    int height = exact_sign(exact_sum(
        exact_product(u.z, ra.z), exact_sum(exact_product(v.z, rb.z), exact_product(w.z, rc.z))));
    uint result = 0u;
    if (height == 0 && is_between(p.x, a.x, b.x, c.x) && is_between(p.y, a.y, b.y, c.y) &&
        is_between(p.z, a.z, b.z, c.z) && !any_opposite(uz, vz, wz) &&
        !any_opposite(exact_sign(u.x), exact_sign(v.x), exact_sign(w.x)) &&
        !any_opposite(exact_sign(u.y), exact_sign(v.y), exact_sign(w.y))) {
        result = kIsOnTriangle;
    }
    int side = moved_edge_sign(uz, b, c);
    if (side == 0 || moved_edge_sign(vz, c, a) != side || moved_edge_sign(wz, a, b) != side)
        return result;
    // The height changes by -(n . move), with n the normal, whose z has the sign `side`.
    if (height == 0) height = -exact_sign(exact_sum(u.x, exact_sum(v.x, w.x)));
    if (height == 0) height = -exact_sign(exact_sum(u.y, exact_sum(v.y, w.y)));
    if (height == 0) height = -side;
    if (height != side) return result;
    return result | (side > 0 ? kCrossesUp : kCrossesDown);
}

/// exact_crossing() in floats where they suffice. Nothing for a triangle with a vertex that is not
/// finite.
SHARED uint cross_upwards(vec3 p, vec3 a, vec3 b, vec3 c) {
    if (!finite_vertices(a, b, c)) return 0u;
    FloatCrossing crossing = float_crossing(p, a, b, c);
    if (crossing.is_uncertain) return exact_crossing(p, a, b, c);
    return crossing.is_up ? kCrossesUp : crossing.is_down ? kCrossesDown : 0u;
}

/// A point as cross_upwards() takes it: one outside of scene space becomes one nearer to it that
/// has the same crossings, since none of its components lies between those of a vertex and p's.
SHARED vec3 clipped_point(vec3 p) {
    const float most = 2.0f * kSceneExtent;
    return vec3(lesser(greater(p.x, -most), most), lesser(greater(p.y, -most), most),
                lesser(greater(p.z, -most), most));
}

#endif

SHARED_END

#endif  // per Float type
