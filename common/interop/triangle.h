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
// depend on the tree that led to it (docs/arithmetic.md, "Boxes").
//
// The displacement is some 2^-23 of a triangle's own size.
//
// That arithmetic is for the few triangles that may be hit. A tracer sorts out the rest by any test
// that never rejects a hit; may_hit is one.
#ifndef COMMON_INTEROP_TRIANGLE_H
#define COMMON_INTEROP_TRIANGLE_H

#include "common/interop/slab.h"

SHARED_BEGIN

/// What the rule needs of a ray: axis is that of its largest direction component; org and dir are
/// rotated so that it is z. rdz = 1 / dir.z.
struct ShearedRay {
    vec3 org;
    vec3 dir;
    uint axis;
    float rdz;
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
    s.rdz = s.dir.z == 0.0f ? 0.0f : rcp(s.dir.z);
    return s;
}

/// The rounding error of the product p = a * b, exact (T. J. Dekker. A floating-point technique for
/// extending the available precision. 1971; with Veltkamp's splitting into 12 + 12 bits).
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
SHARED float difference_error(float a, float b, float d) {
    PRECISE float bv = a - d;
    PRECISE float av = d + bv;
    PRECISE float be = bv - b;
    PRECISE float ae = a - av;
    PRECISE float e = ae + be;
    return e;
}

/// a * b - c * d with the errors of both products: relative error of about 3 ulp, and exact sign.
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
SHARED vec3 project(ShearedRay s, vec3 vertex) {
    vec3 v = rotate_axes(vertex, s.axis);
    PRECISE vec3 a = v - s.org;
    float ex = difference_error(v.x, s.org.x, a.x);
    float ey = difference_error(v.y, s.org.y, a.y);
    float ez = difference_error(v.z, s.org.z, a.z);
    return vec3(project_axis(a.x, ex, a.z, ez, s.dir.x, s.dir.z),
                project_axis(a.y, ey, a.z, ez, s.dir.y, s.dir.z), a.z);
}

/// Likewise without the errors: to 2^-20 of the largest coordinate of a.
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

/// Whether hit_projected may be true for the vertices that project_fast made a, b, c of. It is
/// false only where the signs of two edge functions are certain and opposite.
///
/// With |d| < 2 and r the largest |coordinate| of the three vertices relative to the origin, x and
/// y of project_fast are within delta = 2^-20 r of those of project: 2^-24 each for the two
/// products
/// (<= 2r), their difference (<= 4r) and the rounding of a (<= 4r) make 12 * 2^-24 r. Hence an edge
/// function of p, q with m = |p.x| + |p.y| + |q.x| + |q.y| is within delta m + 2 delta^2 of the
/// other's, and its own rounding is at most 2^-23 (m/2)^2 <= 2^-21 r m since m <= 16 r. The bound
/// below covers both for all three edges. x and y bound the other two coordinates of a: |a.x| <=
/// |x| + 2 |a.z|.
SHARED bool may_hit(vec3 a, vec3 b, vec3 c) {
    PRECISE float ma = abs(a.x) + abs(a.y);
    PRECISE float mb = abs(b.x) + abs(b.y);
    PRECISE float mc = abs(c.x) + abs(c.y);
    PRECISE float m = (ma + mb) + mc;
    PRECISE float z = max(abs(a.z), max(abs(b.z), abs(c.z)));
    PRECISE float r = m + 4.0f * z;
    PRECISE float bound = (kFastProjectionError * r) * (m + kFastProjectionError * r);
    PRECISE float u0 = b.x * c.y;
    PRECISE float u1 = b.y * c.x;
    PRECISE float v0 = c.x * a.y;
    PRECISE float v1 = c.y * a.x;
    PRECISE float w0 = a.x * b.y;
    PRECISE float w1 = a.y * b.x;
    PRECISE float u = u0 - u1;
    PRECISE float v = v0 - v1;
    PRECISE float w = w0 - w1;
    float least = min(u, min(v, w));
    float most = max(u, max(v, w));
    return least >= -bound || most <= bound;
}

/// weight / sum for 0 <= weight <= sum, and 0 for a quotient below 2^-60 (which might be a
/// denormal).
SHARED float normalized_weight(float weight, float sum, float rsum) {
    uint gap = (floatBitsToUint(sum) >> 23u) - (floatBitsToUint(weight) >> 23u);
    PRECISE float w = weight * rsum;
    return weight == 0.0f || gap > 60u ? 0.0f : w;
}

/// t and the barycentric weights u of b and v of c.
struct TriangleHit {
    float t;
    float u;
    float v;
};

/// The rule itself, on projected vertices. Whether there is a hit with tnear <= t <= tfar and t >
/// 0. Triangles that are seen edge-on or have no area are not hit.
SHARED bool hit_projected(ShearedRay s, float tnear, float tfar, vec3 a, vec3 b, vec3 c,
                          OUT(TriangleHit) hit) {
    float eu = difference_of_products(b.x, c.y, b.y, c.x);
    float ev = difference_of_products(c.x, a.y, c.y, a.x);
    float ew = difference_of_products(a.x, b.y, a.y, b.x);
    bool inside =
        (eu >= 0.0f && ev >= 0.0f && ew >= 0.0f) || (eu <= 0.0f && ev <= 0.0f && ew <= 0.0f);
    PRECISE float sum = (abs(eu) + abs(ev)) + abs(ew);
    float rsum = rcp(sum > 0.0f ? sum : 1.0f);
    PRECISE float wa = normalized_weight(abs(eu), sum, rsum);
    PRECISE float wb = normalized_weight(abs(ev), sum, rsum);
    PRECISE float wc = normalized_weight(abs(ew), sum, rsum);
    PRECISE float z = (wa * a.z + wb * b.z) + wc * c.z;
    PRECISE float t = z * s.rdz;
    hit.t = t;
    hit.u = wb;
    hit.v = wc;
    return inside && sum > 0.0f && t > 0.0f && t >= tnear && t <= tfar;
}

/// A vertex that is not finite is stored as kInvalidCoordinate; its triangles are never hit.
SHARED bool finite_vertices(vec3 a, vec3 b, vec3 c) {
    return max(a.x, max(b.x, c.x)) <= kSceneExtent;
}

/// Whether (e1 + r1) * (f2 + s2) - (e2 + r2) * (f1 + s1) is 0 because every product that a rounding
/// error r or s takes part in is 0 and the others cancel exactly.
SHARED bool products_cancel(float e1, float r1, float e2, float r2, float f1, float s1, float f2,
                            float s2) {
    return difference_of_products(e1, f2, e2, f1) == 0.0f && (r1 == 0.0f || f2 == 0.0f) &&
           (s2 == 0.0f || e1 == 0.0f) && (r2 == 0.0f || f1 == 0.0f) && (s1 == 0.0f || e2 == 0.0f);
}

/// Whether a triangle has an area. It has none where its vertices are collinear and the differences
/// of their coordinates are floats or do not matter, and then certainly so; elsewhere it counts as
/// having one.
SHARED bool has_area(vec3 a, vec3 b, vec3 c) {
    PRECISE vec3 e = b - a;
    PRECISE vec3 f = c - a;
    vec3 r = vec3(difference_error(b.x, a.x, e.x), difference_error(b.y, a.y, e.y),
                  difference_error(b.z, a.z, e.z));
    vec3 s = vec3(difference_error(c.x, a.x, f.x), difference_error(c.y, a.y, f.y),
                  difference_error(c.z, a.z, f.z));
    return !products_cancel(e.y, r.y, e.z, r.z, f.y, s.y, f.z, s.z) ||
           !products_cancel(e.z, r.z, e.x, r.x, f.z, s.z, f.x, s.x) ||
           !products_cancel(e.x, r.x, e.y, r.y, f.x, s.x, f.y, s.y);
}

/// Whether the ray hits the triangle a, b, c (scene space), and where. Triangles without area and
/// those with a vertex that is not finite are never hit.
SHARED bool intersect_triangle(ShearedRay s, float tnear, float tfar, vec3 a, vec3 b, vec3 c,
                               OUT(TriangleHit) hit) {
    vec3 pa = project(s, a);
    vec3 pb = project(s, b);
    vec3 pc = project(s, c);
    bool is_hit = hit_projected(s, tnear, tfar, pa, pb, pc, hit);
    return is_hit && finite_vertices(a, b, c) && has_area(a, b, c);
}

/// Whether intersect_triangle may be true: cheap, and never wrong when it says no.
SHARED bool may_hit_triangle(ShearedRay s, vec3 a, vec3 b, vec3 c) {
    return may_hit(project_fast(s, a), project_fast(s, b), project_fast(s, c));
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

#endif  // COMMON_INTEROP_TRIANGLE_H
