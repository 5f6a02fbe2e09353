// The hit rule: which triangles a ray hits, and where. One text for every backend: floats, Highway
// vectors (cpu/simd/lanes-inl.h) and GLSL.
//
// Based on: S. Woop, C. Benthin, I. Wald. Watertight Ray/Triangle Intersection. JCGT 2(1), 2013.
// Changed: no division, errors carried to exact signs, a fast path with a bound of its error.
//
// Exact path. The ray is sheared so that it becomes the z axis of a plane of projection: with d the
// direction, its largest component taken as z, and a = vertex - org,
//     x = a.x * d.z - d.x * a.z,     y = a.y * d.z - d.y * a.z,     z = a.z.
// 1. All triangles project a vertex to the same point.
// 2. The point carries the errors of the difference and of the products, so it is off by some ulp
//    of its distance from the *ray*, not from the origin.
// 3. The sign of an edge function x0*y1 - y0*x1 on such points is exact.
// 4. So the ray hits exactly those triangles of an imperceptibly displaced mesh that contain the
//    origin of the plane, edges and vertices included: a closed mesh has no leaks, not even at
//    vertices.
//
// Depth is the average of the vertices' z under weights that are accurate to a few ulp, so a hit
// lies between its vertices however thin or steep the triangle is. Hence a ray passes the box of a
// triangle that it hits within rounding, t is within a margin of where it does, and the answer
// cannot depend on the tree that led to it (docs/design/arithmetic.md, "Boxes").
//
// The displacement is some 2^-23 of a triangle's own size. A triangle without area is hit as a
// sliver of that width: it fills the crack that the displacement opens between its neighbours.
//
// Fast path. Plain floats with a bound of their error are certain of the signs, and give the
// weights too, except near edges, for steep triangles, and next to the ray's origin. A tracer may
// reject triangles by any test that never rejects a hit, such as may_hit_triangle.
#if !defined(COMMON_INTEROP_HIT_RULE_H) || defined(SHARED_LANES)
#ifndef COMMON_INTEROP_HIT_RULE_H
#define COMMON_INTEROP_HIT_RULE_H

#include "common/interop/pairs.h"
#include "common/interop/slab.h"

#endif

SHARED_BEGIN

/// A ray as the rule takes it: axis is that of its largest direction component; org and dir are
/// rotated so that it is z. depth_slack is a quarter of the depth margin.
struct ShearedRay {
    Float3 org, dir;
    Uint axis;
    Float depth_slack;
};

/// v with its axes rotated so that component `axis` becomes z.
SHARED Float3 rotate_axes(Float3 v, Uint axis) {
    return select(axis == 0u, Float3(v.y, v.z, v.x), select(axis == 1u, Float3(v.z, v.x, v.y), v));
}

SHARED Pair3 rotate_pairs(Pair3 v, Uint axis) {
    v.hi = rotate_axes(v.hi, axis);
    v.lo = rotate_axes(v.lo, axis);
    return v;
}

SHARED ShearedRay shear_ray(Float3 org, Float3 dir) {
    ShearedRay s;
    s.axis = largest_axis(dir);
    s.org = rotate_axes(org, s.axis);
    s.dir = rotate_axes(dir, s.axis);
    PRECISE Float slack = 0.25f * depth_margin(org);
    s.depth_slack = slack;
    return s;
}

/// a * b - c * d with the errors of both products: relative error of about 3 ulp, and exact sign.
/// lab/proofs/difference_of_products.g, lab/proofs/small_floats.cpp.
SHARED Float difference_of_products(Float a, Float b, Float c, Float d) {
    PRECISE Float left = a * b;
    PRECISE Float right = c * d;
    PRECISE Float major = left - right;
    PRECISE Float minor = product_error(a, b, left) - product_error(c, d, right);
    PRECISE Float sum = major + minor;
    return sum;
}

/// a.x * d.z - d.x * a.z for a = vertex - org given as rounded difference and its error.
SHARED Float project_axis(Float ax, Float ax_error, Float az, Float az_error, Float dx, Float dz) {
    PRECISE Float major = difference_of_products(ax, dz, dx, az);
    PRECISE Float left = ax_error * dz;
    PRECISE Float right = dx * az_error;
    PRECISE Float minor = left - right;
    PRECISE Float sum = major + minor;
    return snap_projected(sum);
}

/// project() of a vertex with rotated axes.
SHARED Float3 project_rotated(ShearedRay s, Float3 vertex) {
    PRECISE Float3 a = vertex - s.org;
    Float ex = difference_error(vertex.x, s.org.x, a.x);
    Float ey = difference_error(vertex.y, s.org.y, a.y);
    Float ez = difference_error(vertex.z, s.org.z, a.z);
    return Float3(project_axis(a.x, ex, a.z, ez, s.dir.x, s.dir.z),
                  project_axis(a.y, ey, a.z, ez, s.dir.y, s.dir.z), a.z);
}

/// A vertex (scene space) as the ray sees it, to 2^-22 of its distance from the ray and 2^-44 of
/// that from the origin. Checked: lab/proofs/project.g.
SHARED Float3 project(ShearedRay s, Float3 vertex) {
    return project_rotated(s, rotate_axes(vertex, s.axis));
}

/// project_fast() of a = vertex - org, both with rotated axes, for a ray with this sheared
/// direction.
SHARED Float3 project_relative_fast(Float3 dir, Float3 a) {
    PRECISE Float x0 = a.x * dir.z;
    PRECISE Float x1 = dir.x * a.z;
    PRECISE Float y0 = a.y * dir.z;
    PRECISE Float y1 = dir.y * a.z;
    PRECISE Float3 p = Float3(x0 - x1, y0 - y1, a.z);
    return p;
}

/// project_fast() of a vertex with rotated axes.
SHARED Float3 project_rotated_fast(ShearedRay s, Float3 vertex) {
    PRECISE Float3 a = vertex - s.org;
    return project_relative_fast(s.dir, a);
}

/// project() without the errors and off the grid: to 2^-21 of the largest coordinate of
/// vertex - org, and some ulp of x or y.
SHARED Float3 project_fast(ShearedRay s, Float3 vertex) {
    return project_rotated_fast(s, rotate_axes(vertex, s.axis));
}

/// The edge functions of a triangle opposite to a, b and c; how far each may be from that of the
/// vertices as `project` gives them; the range and the largest size of the vertices' z; and how far
/// each may be from that of the vertices as they are.
struct Edges {
    Float u, v, w;
    Float bound;
    Float depth_range, depth_size;
    Float real_bound;
};

SHARED void measure_depth(Float za, Float zb, Float zc, INOUT(Edges) e) {
    Float nearest = lesser(za, lesser(zb, zc));
    Float farthest = greater(za, greater(zb, zc));
    PRECISE Float range = farthest - nearest;
    e.depth_range = range;
    e.depth_size = greater(abs(nearest), abs(farthest));
}

/// The size of a projected vertex, of which m of edge_bound is the sum.
SHARED Float projected_size(Float3 p) {
    PRECISE Float size = abs(p.x) + abs(p.y);
    return size;
}

/// The bound of fast_edges: m is the sum of |x| + |y| over the vertices, depth_size the largest
/// |z|.
SHARED Float edge_bound(Float m, Float depth_size) {
    PRECISE Float r = kFastProjectionError * ((m + m) + depth_size) + kFastProjectionFloor;
    PRECISE Float bound = r * (m + (r + r));
    return bound;
}

SHARED Float fast_edge(Float3 p, Float3 q) {
    PRECISE Float e0 = p.x * q.y;
    PRECISE Float e1 = p.y * q.x;
    PRECISE Float e = e0 - e1;
    return e;
}

/// The edge functions of vertices from project_fast.
///
/// With m the sum of |x| + |y| over the vertices and Z the largest |z|, each x and y is within
/// r = 2^-21 (2 m + Z) + 2^-49 of that of `project`, so each function is within r (m + 2 r):
/// docs/design/arithmetic.md, "Plain floats where they suffice". The 2^-49 covers products that
/// underflow. Checked: lab/proofs/fast_edges.g.
SHARED Edges fast_edges(Float3 a, Float3 b, Float3 c) {
    PRECISE Float m = (projected_size(a) + projected_size(b)) + projected_size(c);
    Edges e;
    measure_depth(a.z, b.z, c.z, e);
    e.u = fast_edge(b, c);
    e.v = fast_edge(c, a);
    e.w = fast_edge(a, b);
    e.bound = edge_bound(m, e.depth_size);
    e.real_bound = e.bound;
    return e;
}

/// The edge functions of vertices from project; their signs are exact. The errors of project add
/// less than fast_edges has without depths, but for 2^-44 of these.
SHARED Edges exact_edges(Float3 a, Float3 b, Float3 c) {
    PRECISE Float m = (projected_size(a) + projected_size(b)) + projected_size(c);
    Edges e;
    e.u = difference_of_products(b.x, c.y, b.y, c.x);
    e.v = difference_of_products(c.x, a.y, c.y, a.x);
    e.w = difference_of_products(a.x, b.y, a.y, b.x);
    e.bound = broadcast(0.0f);
    measure_depth(a.z, b.z, c.z, e);
    PRECISE Float far = kFarProjectionError * e.depth_size;
    e.real_bound = edge_bound(m, far);
    return e;
}

/// Whether the ray may go through the triangle: false only if two signs are certain and opposite.
SHARED Bool may_be_inside(Edges e) {
    return lesser(e.u, lesser(e.v, e.w)) >= -e.bound || greater(e.u, greater(e.v, e.w)) <= e.bound;
}

/// Whether all signs are certain and equal, and the edge functions accurate enough as weights of z.
/// Their errors move z by at most 2 * bound / sum of depth_range; that must stay a part of the
/// depth margin M for a hit never to lie before its box by more than M. (Of M, 2^-5 is left to
/// other errors, a quarter goes here twice over.) Checked: lab/proofs/fast_edges.g, depth.g,
/// boxes.g.
SHARED Bool surely_inside(ShearedRay s, Edges e) {
    PRECISE Float sum = (abs(e.u) + abs(e.v)) + abs(e.w);
    // A range below 1 cannot matter, and its product with the bound might be a denormal.
    PRECISE Float error = e.bound * greater(e.depth_range, 1.0f);
    PRECISE Float allowed = s.depth_slack * sum;
    return error <= allowed &&
           (lesser(e.u, lesser(e.v, e.w)) > e.bound || greater(e.u, greater(e.v, e.w)) < -e.bound);
}

/// t and the barycentric weights u of b and v of c. Until it is refined, |t - exact t| <= error; it
/// is rough if that is more than `allowed`.
struct TriangleHit {
    Float t, u, v, error, allowed;
};

/// weight * scale for 0 <= weight <= sum, where scale is 1 / sum up to a factor of 2; and 0 if
/// weight / sum is below 2^-60, when the product might be a denormal.
SHARED Float scaled_weight(Float weight, Float sum, Float scale) {
    Uint gap = (floatBitsToUint(sum) >> 23u) - (floatBitsToUint(weight) >> 23u);
    PRECISE Float w = weight * scale;
    return select(weight == 0.0f || gap > 60u, 0.0f, w);
}

/// The error of t from which on a hit is rough.
SHARED Float allowed_error(Float depth_range, Float z, Float t) {
    PRECISE Float four = 4.0f * depth_range;
    PRECISE Float allowed = select(four > z, broadcast(kRoughDepth), broadcast(kRoughSlope)) * t;
    return allowed;
}

/// The hit of a ray that goes through a triangle, from its edge functions and the vertices' z. The
/// weights add up to 1, so that their errors move z by parts of its range only: by 2 * bound / sum
/// and kWeightRounding of that, and kMeanRounding of the vertices' size (lab/proofs/depth.g).
/// Whether the sign of z is certain: z is beyond its error, or the vertices' z have one sign, so
/// that z has it (a sum of products of that sign; their range is less than their size then).
SHARED Bool weighted_hit(ShearedRay s, Edges e, Float za, Float zb, Float zc,
                         OUT(TriangleHit) hit) {
    PRECISE Float sum = (abs(e.u) + abs(e.v)) + abs(e.w);
    Bool is_any = sum > 0.0f;
    Float scale = rcp_of_positive(select(is_any, sum, 1.0f));
    Float wb = scaled_weight(abs(e.v), sum, scale);
    Float wc = scaled_weight(abs(e.w), sum, scale);
    PRECISE Float rest = 1.0f - (wb + wc);
    Float wa = greater(rest, 0.0f);
    PRECISE Float mean = (wa * za + wb * zb) + wc * zc;
    // Rounding may put the mean beyond all vertices, whose depths may be equal.
    Float nearest = lesser(za, lesser(zb, zc));
    Float farthest = greater(za, greater(zb, zc));
    Float z = lesser(greater(mean, nearest), farthest);
    PRECISE Float t = z * rcp(select(is_any, s.dir.z, 1.0f));
    PRECISE Float by_range = 2.0f * (e.bound * scale) + kWeightRounding;
    PRECISE Float error = by_range * e.depth_range + kMeanRounding * e.depth_size;
    hit.t = t;
    hit.u = wb;
    hit.v = wc;
    PRECISE Float by_real_range = 6.0f * (e.real_bound * scale) + kHitRounding;
    PRECISE Float rounding = kHitRounding * e.depth_size;
    PRECISE Float hit_error = by_real_range * e.depth_range + rounding;
    hit.error = hit_error;
    hit.allowed = allowed_error(e.depth_range, abs(z), abs(t));
    return e.depth_range < e.depth_size || abs(z) > error;
}

/// True if t of the hit may be off by more than is allowed: then call refine_hit().
SHARED Bool is_rough(TriangleHit hit) { return hit.error > hit.allowed; }

/// True if t, which refine_hit() moves by at most hit.error, may end in [tnear, tfar].
SHARED Bool may_be_in_range(TriangleHit hit, Float tnear, Float tfar) {
    PRECISE Float least = hit.t - hit.error;
    PRECISE Float most = hit.t + hit.error;
    return most > 0.0f && most >= tnear && least <= tfar;
}

/// weighted_hit() with edge functions from exact_edges: whether the ray hits the triangle
/// somewhere, and where.
SHARED Bool exact_hit(ShearedRay s, Edges e, Float za, Float zb, Float zc, OUT(TriangleHit) hit) {
    Bool is_certain = weighted_hit(s, e, za, zb, zc, hit);
    return may_be_inside(e) && is_certain && greater(abs(e.u), greater(abs(e.v), abs(e.w))) > 0.0f;
}

/// A vertex that is not finite is stored as kInvalidCoordinate on all axes; its triangles are never
/// hit. a, b, c: any one coordinate of the vertices.
SHARED Bool finite_coordinates(Float a, Float b, Float c) {
    return greater(a, greater(b, c)) <= kSceneExtent;
}

SHARED Bool finite_vertices(Float3 a, Float3 b, Float3 c) {
    return finite_coordinates(a.x, b.x, c.x);
}

/// Whether intersect_triangle may be true: cheap, and never wrong when it says no.
SHARED Bool may_hit_triangle(ShearedRay s, Float3 a, Float3 b, Float3 c) {
    return may_be_inside(fast_edges(project_fast(s, a), project_fast(s, b), project_fast(s, c)));
}

/// A hit counts if t > 0 and tnear <= t <= tfar.
SHARED Bool is_in_range(Float t, Float tnear, Float tfar) {
    return t > 0.0f && t >= tnear && t <= tfar;
}

/// Hits are ordered by t, and those of equal t by prim_id. True if a hit comes before the closest
/// one so far. A search begins with (tfar, kNoPrim) as the closest.
SHARED Bool is_closer(Float t, Uint prim_id, Float closest_t, Uint closest_prim) {
    return t < closest_t || (t == closest_t && prim_id < closest_prim);
}

/// Sets t, u and v of a rough hit to those of the place where the ray meets the plane of the
/// triangle a, b, c, whose axes are rotated, in pairs of floats. With s = a - org, e1 = b - a, e2 =
/// c - a, n = e1 x e2 and p = t dir - s:
///     t = n.s / n.dir,   u = (p x e2).k / n.k,   v = (e1 x p).k / n.k,   k the largest axis of n.
/// A ray that only passes the displaced vertices may meet the plane elsewhere: t is kept where it
/// passes the triangle's own box, and so where it passes all boxes around it; u and v are no less
/// than 0 and add up to no more than 1. Bounds: lab/proofs/place.g. e: as for the hit.
SHARED void refine_hit(ShearedRay s, Edges e, Float3 a, Float3 b, Float3 c,
                       INOUT(TriangleHit) hit) {
    // The box first, so that few registers are in use at a time.
    Float first;
    Float last;
    padded_interval(slab_ray(s.org, s.dir), lesser3(a, lesser3(b, c)), greater3(a, greater3(b, c)),
                    first, last);

    Pair3 e1 = pair_difference(b, a);
    Pair3 e2 = pair_difference(c, a);
    Pair3 way = pair_difference(a, s.org);
    Pair3 n = pair_cross(e1, e2);
    Pair height = pair_dot(n, way);
    Pair slant = pair_dot(n, s.dir);
    Pair t;
    Bool is_known = pair_quotient(height, slant, t);
    Float kept = lesser(greater(t.hi, first), last);
    // Pairs may leave no digit of a plane that the ray all but lies in. There the mean stays, as
    // everywhere where its error is less than 16 times theirs.
    PRECISE Float3 size = Float3(abs(e1.hi.y * e2.hi.z) + abs(e1.hi.z * e2.hi.y),
                                 abs(e1.hi.z * e2.hi.x) + abs(e1.hi.x * e2.hi.z),
                                 abs(e1.hi.x * e2.hi.y) + abs(e1.hi.y * e2.hi.x));
    Float of_height = dot3(size, Float3(abs(way.hi.x), abs(way.hi.y), abs(way.hi.z)));
    Float of_slant = dot3(size, Float3(abs(s.dir.x), abs(s.dir.y), abs(s.dir.z)));
    PRECISE Float lost = of_height + (of_slant + abs(slant.hi)) * lesser(abs(t.hi), kFarthestHit);
    PRECISE Float room = (kPairRoom * hit.error) * abs(slant.hi);
    PRECISE Float moved = 2.0f * (kept - hit.t);
    is_known = is_known && kept > kTiny && lost <= room && abs(moved) <= hit.error;
    t.lo = select(kept == t.hi, t.lo, 0.0f);
    t.hi = select(is_known, kept, hit.t);

    Pair3 p = pair_vector(way_on_ray(t, s.dir.x, pair_x(way)), way_on_ray(t, s.dir.y, pair_y(way)),
                          way_on_ray(t, s.dir.z, pair_z(way)));
    Uint axis = largest_axis(n.hi);
    p = rotate_pairs(p, axis);
    e1 = rotate_pairs(e1, axis);
    e2 = rotate_pairs(e2, axis);
    Pair whole = pair_z(rotate_pairs(n, axis));
    Pair u;
    Pair v;
    is_known = pair_quotient(pair_minor(pair_x(p), pair_y(e2), pair_y(p), pair_x(e2)), whole, u) &&
               is_known;
    is_known = pair_quotient(pair_minor(pair_x(e1), pair_y(p), pair_y(e1), pair_x(p)), whole, v) &&
               is_known;
    Float b_weight = grid_weight(u.hi);
    PRECISE Float rest = 1.0f - b_weight;
    Float c_weight = lesser(grid_weight(v.hi), rest);

    // A ray through an edge of the displaced vertices has no weight across it (may_touch_border).
    b_weight = select(e.v == 0.0f, 0.0f, select(e.u == 0.0f && e.w == 0.0f, 1.0f, b_weight));
    PRECISE Float opposite = 1.0f - b_weight;
    c_weight = select(e.w == 0.0f, 0.0f, select(e.u == 0.0f, opposite, c_weight));
    hit.t = t.hi;
    hit.u = select(is_known, b_weight, hit.u);
    hit.v = select(is_known, c_weight, hit.v);
}

#ifndef SHARED_LANES

/// Refines a hit of weighted_hit() or exact_hit() if it is rough. Returns is_in_range() of it.
SHARED bool is_refined_in_range(ShearedRay s, Edges e, float tnear, float tfar, vec3 a, vec3 b,
                                vec3 c, INOUT(TriangleHit) hit) {
    if (is_rough(hit)) {
        if (!may_be_in_range(hit, tnear, tfar)) return false;
        refine_hit(s, e, rotate_axes(a, s.axis), rotate_axes(b, s.axis), rotate_axes(c, s.axis),
                   hit);
    }
    return is_in_range(hit.t, tnear, tfar);
}

/// Whether the ray hits the triangle a, b, c (scene space), and where. Triangles with a vertex that
/// is not finite are never hit; those without area only where their projected vertices are not
/// collinear. A ray that starts on a triangle hits it only if the rounding of the projected
/// vertices moves the hit to t > 0. A ray that sees a triangle edge-on (all three functions are 0)
/// does not hit it. On vectors: intersect_triangles (cpu/simd/hit_rule-inl.h).
SHARED bool intersect_triangle(ShearedRay s, float tnear, float tfar, vec3 a, vec3 b, vec3 c,
                               OUT(TriangleHit) hit) {
    vec3 pa = project_fast(s, a);
    vec3 pb = project_fast(s, b);
    vec3 pc = project_fast(s, c);
    Edges e = fast_edges(pa, pb, pc);
    bool is_certain = weighted_hit(s, e, pa.z, pb.z, pc.z, hit);
    bool is_hit = surely_inside(s, e) && is_certain;
    if (!is_hit) {
        e = exact_edges(project(s, a), project(s, b), project(s, c));
        is_hit = exact_hit(s, e, pa.z, pb.z, pc.z, hit);
    }
    return is_hit && finite_vertices(a, b, c) &&
           is_refined_in_range(s, e, tnear, tfar, a, b, c, hit);
}

SHARED Hit make_hit(TriangleHit hit, uint prim_id) {
    Hit h;
    h.t = hit.t;
    h.u = hit.u;
    h.v = hit.v;
    h.prim_id = prim_id;
    return h;
}

#endif

SHARED_END

#endif  // per Float type
