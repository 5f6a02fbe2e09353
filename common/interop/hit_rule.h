// The hit rule: which triangles a ray hits, and where. One text for every backend.
//
// The ray is sheared so that it becomes the z axis of a plane of projection (S. Woop, C. Benthin,
// I. Wald. Watertight Ray/Triangle Intersection. JCGT 2(1), 2013), here without a division: with d
// the direction, its largest component taken as z, and a = vertex - org,
//     x = a.x * d.z - d.x * a.z,     y = a.y * d.z - d.y * a.z,     z = a.z.
// A vertex has one such point whichever triangle it is seen from. The point carries the errors of
// the difference and of the products, so that it is off by some ulp of its distance from the *ray*,
// not from the origin; and the sign of an edge function x0*y1 - y0*x1 on such points is exact. So
// the ray goes through exactly those triangles of an imperceptibly displaced mesh that contain the
// origin of the plane, edges and vertices included, and a closed mesh stays closed: nothing leaks,
// at vertices neither.
//
// Depth is the average of the vertices' z under weights that are accurate to a few ulp, so a hit
// lies between its vertices however thin the triangle is or however much along the ray it lies.
// Hence a hit is never outside its triangle's box by more than rounding, and the answer cannot
// depend on the tree that led to it (docs/design/arithmetic.md, "Boxes").
//
// The displacement is some 2^-23 of a triangle's own size. A triangle without area is a sliver as
// narrow as that, and is hit there: it fills the crack that the displacement opens between its
// neighbours.
//
// That arithmetic is for the rays that pass close to an edge, for steep triangles, and for rays
// that start next to a triangle. Elsewhere plain floats with a bound of their error are certain of
// the signs, and give the weights too; a tracer may sort out misses by any test that never rejects
// a hit, such as may_hit_triangle.
#ifndef COMMON_INTEROP_HIT_RULE_H
#define COMMON_INTEROP_HIT_RULE_H

#include "common/interop/slab.h"

SHARED_BEGIN

/// What the rule needs of a ray: axis is that of its largest direction component; org and dir are
/// rotated so that it is z. depth_slack is a quarter of the dilation of boxes.
struct ShearedRay {
    vec3 org;
    vec3 dir;
    uint axis;
    float depth_slack;
};

/// v with its axes rotated so that component `axis` becomes z.
SHARED vec3 rotate_axes(vec3 v, uint axis) {
    return axis == 0u ? vec3(v.y, v.z, v.x) : axis == 1u ? vec3(v.z, v.x, v.y) : v;
}

SHARED ShearedRay shear_ray(vec3 org, vec3 dir) {
    vec3 size = vec3(abs(dir.x), abs(dir.y), abs(dir.z));
    ShearedRay s;
    s.axis = size.x >= size.y && size.x >= size.z ? 0u : size.y >= size.z ? 1u : 2u;
    s.org = rotate_axes(org, s.axis);
    s.dir = rotate_axes(dir, s.axis);
    PRECISE float slack = 0.25f * box_dilation(org);
    s.depth_slack = slack;
    return s;
}

/// The rounding error of the product p = a * b, exact (T. J. Dekker. A floating-point technique for
/// extending the available precision. 1971; with Veltkamp's splitting into 12 + 12 bits).
/// Exact: proofs/small_floats.cpp.
SHARED float product_error(float a, float b, float p) {
    PRECISE float ca = 4097.0f * a;
    PRECISE float cb = 4097.0f * b;
    PRECISE float ta = ca - a;
    PRECISE float tb = cb - b;
    PRECISE float ah = ca - ta;
    PRECISE float bh = cb - tb;
    PRECISE float al = a - ah;
    PRECISE float bl = b - bh;
    PRECISE float hh = ah * bh;
    PRECISE float hl = ah * bl;
    PRECISE float lh = al * bh;
    PRECISE float ll = al * bl;
    PRECISE float e0 = hh - p;
    PRECISE float e1 = e0 + hl;
    PRECISE float e2 = e1 + lh;
    PRECISE float e3 = e2 + ll;
    return e3;
}

/// The rounding error of the difference d = a - b, exact (D. E. Knuth. TAOCP 2, 4.2.2, theorem B).
/// Exact: proofs/small_floats.cpp.
SHARED float difference_error(float a, float b, float d) {
    PRECISE float bv = a - d;
    PRECISE float av = d + bv;
    PRECISE float be = bv - b;
    PRECISE float ae = a - av;
    PRECISE float e = ae + be;
    return e;
}

/// a * b - c * d with the errors of both products: relative error of about 3 ulp, and exact sign.
/// proofs/difference_of_products.g, proofs/small_floats.cpp.
SHARED float difference_of_products(float a, float b, float c, float d) {
    PRECISE float left = a * b;
    PRECISE float right = c * d;
    PRECISE float major = left - right;
    PRECISE float minor = product_error(a, b, left) - product_error(c, d, right);
    PRECISE float sum = major + minor;
    // minor is never larger than a major that is not 0, but its rounding may make the two cancel.
    return sum == 0.0f ? major : sum;
}

/// x on the grid 2^-63, so that products of two such values are no denormals: |x| >= 2^-40 is on it
/// already, smaller values round through the ulp of the constant.
SHARED float snap_projected(float x) {
    PRECISE float s = x + kProjectedSnap;
    PRECISE float r = s - kProjectedSnap;
    return abs(x) >= kProjectedOnGrid ? x : r;
}

/// a.x * d.z - d.x * a.z for a = vertex - org given as rounded difference and its error.
SHARED float project_axis(float ax, float ax_error, float az, float az_error, float dx, float dz) {
    PRECISE float major = difference_of_products(ax, dz, dx, az);
    PRECISE float left = ax_error * dz;
    PRECISE float right = dx * az_error;
    PRECISE float minor = left - right;
    PRECISE float sum = major + minor;
    return snap_projected(sum);
}

/// A vertex (scene space) as the ray sees it, to 2^-22 of its distance from the ray and 2^-44 of
/// that from the origin.
/// Checked: proofs/project.g.
SHARED vec3 project(ShearedRay s, vec3 vertex) {
    vec3 v = rotate_axes(vertex, s.axis);
    PRECISE vec3 a = v - s.org;
    float ex = difference_error(v.x, s.org.x, a.x);
    float ey = difference_error(v.y, s.org.y, a.y);
    float ez = difference_error(v.z, s.org.z, a.z);
    return vec3(project_axis(a.x, ex, a.z, ez, s.dir.x, s.dir.z),
                project_axis(a.y, ey, a.z, ez, s.dir.y, s.dir.z), a.z);
}

/// Likewise without the errors and off the grid: to 2^-21 of the largest coordinate of a, and some
/// ulp of x or y.
SHARED vec3 project_fast(ShearedRay s, vec3 vertex) {
    vec3 v = rotate_axes(vertex, s.axis);
    PRECISE vec3 a = v - s.org;
    PRECISE float x0 = a.x * s.dir.z;
    PRECISE float x1 = s.dir.x * a.z;
    PRECISE float y0 = a.y * s.dir.z;
    PRECISE float y1 = s.dir.y * a.z;
    PRECISE vec3 p = vec3(x0 - x1, y0 - y1, a.z);
    return p;
}

/// The edge functions of a triangle opposite to a, b and c; how far each may be from that of the
/// vertices as `project` gives them; and the range and the largest size of the vertices' z.
struct Edges {
    float u;
    float v;
    float w;
    float bound;
    float depth_range;
    float depth_size;
};

SHARED void measure_depth(float za, float zb, float zc, INOUT(Edges) e) {
    float nearest = lesser(za, lesser(zb, zc));
    float farthest = greater(za, greater(zb, zc));
    PRECISE float range = farthest - nearest;
    e.depth_range = range;
    e.depth_size = greater(abs(nearest), abs(farthest));
}

/// The edge functions of vertices from project_fast.
///
/// With m the sum of |x| + |y| over the vertices and Z the largest |z|, each x and y is within
/// r = 2^-21 (2 m + Z) + 2^-49 of that of `project`, rounding of the functions included, so each
/// function is within r (m + 2 r): docs/design/arithmetic.md, "Plain floats where they suffice".
/// Products may underflow, which the 2^-49 makes too small to matter to a function beyond its
/// bound. Checked: proofs/fast_edges.g.
SHARED Edges fast_edges(vec3 a, vec3 b, vec3 c) {
    PRECISE float ma = abs(a.x) + abs(a.y);
    PRECISE float mb = abs(b.x) + abs(b.y);
    PRECISE float mc = abs(c.x) + abs(c.y);
    PRECISE float m = (ma + mb) + mc;
    Edges e;
    measure_depth(a.z, b.z, c.z, e);
    PRECISE float r = kFastProjectionError * ((m + m) + e.depth_size) + kFastProjectionFloor;
    PRECISE float bound = r * (m + (r + r));
    PRECISE float u0 = b.x * c.y;
    PRECISE float u1 = b.y * c.x;
    PRECISE float v0 = c.x * a.y;
    PRECISE float v1 = c.y * a.x;
    PRECISE float w0 = a.x * b.y;
    PRECISE float w1 = a.y * b.x;
    PRECISE float u = u0 - u1;
    PRECISE float v = v0 - v1;
    PRECISE float w = w0 - w1;
    e.u = u;
    e.v = v;
    e.w = w;
    e.bound = bound;
    return e;
}

/// The edge functions of vertices from project; their signs are exact.
SHARED Edges exact_edges(vec3 a, vec3 b, vec3 c) {
    Edges e;
    e.u = difference_of_products(b.x, c.y, b.y, c.x);
    e.v = difference_of_products(c.x, a.y, c.y, a.x);
    e.w = difference_of_products(a.x, b.y, a.y, b.x);
    e.bound = 0.0f;
    measure_depth(a.z, b.z, c.z, e);
    return e;
}

/// Whether the ray may go through the triangle: false only if two signs are certain and opposite.
SHARED bool may_be_inside(Edges e) {
    return lesser(e.u, lesser(e.v, e.w)) >= -e.bound || greater(e.u, greater(e.v, e.w)) <= e.bound;
}

/// Whether all signs are certain and alike, and the edge functions good enough to weigh z with.
/// Their errors move z by at most 2 * bound / sum of depth_range; that must stay a part of the
/// dilation D of boxes for a hit never to lie before its box. (Of D, 2^-5 is left to other errors,
/// a quarter goes here twice over.)
/// Checked: proofs/fast_edges.g, depth.g, boxes.g.
SHARED bool surely_inside(ShearedRay s, Edges e) {
    PRECISE float sum = (abs(e.u) + abs(e.v)) + abs(e.w);
    // A range below 1 cannot matter, and its product with the bound might be a denormal.
    PRECISE float error = e.bound * greater(e.depth_range, 1.0f);
    PRECISE float allowed = s.depth_slack * sum;
    return error <= allowed &&
           (lesser(e.u, lesser(e.v, e.w)) > e.bound || greater(e.u, greater(e.v, e.w)) < -e.bound);
}

/// t and the barycentric weights u of b and v of c.
struct TriangleHit {
    float t;
    float u;
    float v;
};

/// weight * scale for 0 <= weight <= sum, where scale is 1 / sum up to a factor of 2; and 0 if
/// weight / sum is below 2^-60, when the product might be a denormal.
SHARED float scaled_weight(float weight, float sum, float scale) {
    uint gap = (floatBitsToUint(sum) >> 23u) - (floatBitsToUint(weight) >> 23u);
    PRECISE float w = weight * scale;
    return weight == 0.0f || gap > 60u ? 0.0f : w;
}

/// The hit of a ray that goes through a triangle, from its edge functions and the vertices' z. The
/// weights add up to 1, so that their errors move z by parts of its range only: by 2 * bound / sum
/// and kWeightRounding of that, and kMeanRounding of the vertices' size (proofs/depth.g). Whether
/// the sign of z is certain: z is beyond its error, or the vertices' z have one sign, so that z has
/// it (a sum of products of that sign; their range is less than their size then).
SHARED bool weighted_hit(ShearedRay s, Edges e, float za, float zb, float zc,
                         OUT(TriangleHit) hit) {
    PRECISE float sum = (abs(e.u) + abs(e.v)) + abs(e.w);
    bool is_any = sum > 0.0f;
    float scale = rcp(is_any ? sum : 1.0f);
    float wb = scaled_weight(abs(e.v), sum, scale);
    float wc = scaled_weight(abs(e.w), sum, scale);
    PRECISE float rest = 1.0f - (wb + wc);
    float wa = greater(rest, 0.0f);
    PRECISE float z = (wa * za + wb * zb) + wc * zc;
    PRECISE float t = z * rcp(is_any ? s.dir.z : 1.0f);
    PRECISE float by_range = 2.0f * (e.bound * scale) + kWeightRounding;
    PRECISE float error = by_range * e.depth_range + kMeanRounding * e.depth_size;
    hit.t = t;
    hit.u = wb;
    hit.v = wc;
    return e.depth_range < e.depth_size || abs(z) > error;
}

/// A vertex that is not finite is stored as kInvalidCoordinate; its triangles are never hit.
SHARED bool finite_vertices(vec3 a, vec3 b, vec3 c) {
    return greater(a.x, greater(b.x, c.x)) <= kSceneExtent;
}

/// Whether intersect_triangle may be true: cheap, and never wrong when it says no.
SHARED bool may_hit_triangle(ShearedRay s, vec3 a, vec3 b, vec3 c) {
    return may_be_inside(fast_edges(project_fast(s, a), project_fast(s, b), project_fast(s, c)));
}

/// Whether a hit at t counts for a ray from tnear to tfar.
SHARED bool is_in_range(float t, float tnear, float tfar) {
    return t > 0.0f && t >= tnear && t <= tfar;
}

/// Whether the ray hits the triangle a, b, c (scene space), and where. Triangles with a vertex that
/// is not finite are never hit; those without area only where their projected vertices are not
/// collinear. An origin in the plane of a triangle, up to the error of z, does not hit it, nor does
/// a ray that sees it edge-on (all three functions are 0).
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
        is_certain = weighted_hit(s, e, pa.z, pb.z, pc.z, hit);
        is_hit =
            may_be_inside(e) && is_certain && greater(abs(e.u), greater(abs(e.v), abs(e.w))) > 0.0f;
    }
    return is_hit && is_in_range(hit.t, tnear, tfar) && finite_vertices(a, b, c);
}

/// Whether a hit beats the best so far: nearer, or as near with a smaller id. Before the first hit
/// the best is (tfar, kNoPrim).
SHARED bool wins(float t, uint prim_id, float best_t, uint best_prim) {
    return t < best_t || (t == best_t && prim_id < best_prim);
}

SHARED Hit make_hit(TriangleHit hit, uint prim_id) {
    Hit h;
    h.t = hit.t;
    h.u = hit.u;
    h.v = hit.v;
    h.prim_id = prim_id;
    return h;
}

SHARED_END

#endif  // COMMON_INTEROP_HIT_RULE_H
