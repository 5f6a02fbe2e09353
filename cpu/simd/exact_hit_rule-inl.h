// The whole hit rule (common/interop/hit_rule.h) on vectors: a lane is a ray and a triangle, any of
// either, and has the bits of intersect_triangle.
//
// The functions are those of the same names in the singular, operation by operation, with one
// exception. product_error is the exact error of a rounded product, by any way of finding it: its
// splitting is exact because every partial product is a multiple of the product of the factors'
// grids, at least 2^-126, and far from overflow (docs/design/arithmetic.md, "No denormals"). Where
// there is a fused multiply-subtract, a * b - p rounds the same exact value, which is a float: the
// same bits. Where that value is 0, both are +0: the splitting begins with hh - p, and the sum of a
// +0 and a zero, or of x and -x, is +0.
#if defined(MORPHRAY_CPU_SIMD_EXACT_HIT_RULE_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_SIMD_EXACT_HIT_RULE_INL_H
#undef MORPHRAY_CPU_SIMD_EXACT_HIT_RULE_INL_H
#else
#define MORPHRAY_CPU_SIMD_EXACT_HIT_RULE_INL_H
#endif

#include <hwy/highway.h>

#include <cstdint>

#include "common/interop/hit_rule.h"
#include "cpu/simd/fast_hit_rule-inl.h"

HWY_BEFORE_NAMESPACE();
namespace morphray::cpu {
namespace HWY_NAMESPACE {

/// What the rule needs of rays, a lane each, with rotated axes.
struct RuleRays {
    FloatVec org[3];
    FloatVec dir[3];
    FloatVec depth_slack;
};

/// Vertices as rays see them, a lane each.
struct RulePoints {
    FloatVec x;
    FloatVec y;
    FloatVec z;
};

struct RuleEdges {
    FloatVec u;
    FloatVec v;
    FloatVec w;
    FloatVec bound;
    FloatVec depth_range;
    FloatVec depth_size;
};

struct RuleHits {
    FloatVec t;
    FloatVec u;
    FloatVec v;
};

// ---- Exact errors

HWY_INLINE FloatVec product_errors(FloatVec a, FloatVec b, FloatVec p) {
#if HWY_NATIVE_FMA
    return mul_sub(a, b, p);
#else
    const FloatVec ca = splat(4097.0f) * a;
    const FloatVec cb = splat(4097.0f) * b;
    const FloatVec ah = ca - (ca - a);
    const FloatVec bh = cb - (cb - b);
    const FloatVec al = a - ah;
    const FloatVec bl = b - bh;
    const FloatVec e0 = ah * bh - p;
    const FloatVec e1 = e0 + ah * bl;
    const FloatVec e2 = e1 + al * bh;
    return e2 + al * bl;
#endif
}

HWY_INLINE FloatVec difference_errors(FloatVec a, FloatVec b, FloatVec d) {
    const FloatVec bv = a - d;
    const FloatVec av = d + bv;
    return bv - b + (a - av);
}

HWY_INLINE FloatVec differences_of_products(FloatVec a, FloatVec b, FloatVec c, FloatVec d) {
    const FloatVec left = a * b;
    const FloatVec right = c * d;
    const FloatVec major = left - right;
    const FloatVec minor = product_errors(a, b, left) - product_errors(c, d, right);
    const FloatVec sum = major + minor;
    return select(sum == zero(), major, sum);
}

// ---- Projection

/// The vertices relative to the origins as rounded differences, and the errors of those.
struct RelativeVertices {
    FloatVec a[3];
    FloatVec error[3];
};

HWY_INLINE RelativeVertices relative_vertices(const RuleRays& rays, const FloatVec vertex[3]) {
    RelativeVertices r;
    for (int k = 0; k < 3; ++k) {
        r.a[k] = vertex[k] - rays.org[k];
        r.error[k] = difference_errors(vertex[k], rays.org[k], r.a[k]);
    }
    return r;
}

/// project_axis for x (k = 0) or y (k = 1).
HWY_INLINE FloatVec project_axes(const RuleRays& rays, const RelativeVertices& r, int k) {
    const FloatVec major = differences_of_products(r.a[k], rays.dir[2], rays.dir[k], r.a[2]);
    const FloatVec left = r.error[k] * rays.dir[2];
    const FloatVec right = rays.dir[k] * r.error[2];
    const FloatVec sum = major + (left - right);
    const FloatVec snapped = sum + splat(kProjectedSnap) - splat(kProjectedSnap);
    return select(abs(sum) >= splat(kProjectedOnGrid), sum, snapped);
}

/// `project` of vertices with rotated axes.
HWY_INLINE RulePoints project_points(const RuleRays& rays, const FloatVec vertex[3]) {
    const RelativeVertices r = relative_vertices(rays, vertex);
    return {project_axes(rays, r, 0), project_axes(rays, r, 1), r.a[2]};
}

/// `project_fast` of vertices with rotated axes.
HWY_INLINE RulePoints project_points_fast(const RuleRays& rays, const FloatVec vertex[3]) {
    FloatVec a[3];
    for (int k = 0; k < 3; ++k) a[k] = vertex[k] - rays.org[k];
    const auto axis = [&](int k) { return a[k] * rays.dir[2] - rays.dir[k] * a[2]; };
    return {axis(0), axis(1), a[2]};
}

// ---- Edge functions

HWY_INLINE void measure_depths(FloatVec za, FloatVec zb, FloatVec zc, RuleEdges& e) {
    const FloatVec nearest = min(za, min(zb, zc));
    const FloatVec farthest = max(za, max(zb, zc));
    e.depth_range = farthest - nearest;
    e.depth_size = max(abs(nearest), abs(farthest));
}

/// The bound of fast_edges, from the sum of |x| + |y| and the largest |z| of a triangle.
HWY_INLINE FloatVec edge_bounds(FloatVec m, FloatVec depth_size) {
    const FloatVec size = m + m + depth_size;
    const FloatVec r = splat(kFastProjectionError) * size + splat(kFastProjectionFloor);
    return r * (m + (r + r));
}

HWY_INLINE RuleEdges fast_edge_functions(const RulePoints& a, const RulePoints& b,
                                         const RulePoints& c) {
    const auto size = [](const RulePoints& p) { return abs(p.x) + abs(p.y); };
    const auto edge = [](const RulePoints& p, const RulePoints& q) {
        return p.x * q.y - p.y * q.x;
    };
    RuleEdges e;
    measure_depths(a.z, b.z, c.z, e);
    const FloatVec m = size(a) + size(b) + size(c);
    e.bound = edge_bounds(m, e.depth_size);
    e.u = edge(b, c);
    e.v = edge(c, a);
    e.w = edge(a, b);
    return e;
}

HWY_INLINE RuleEdges exact_edge_functions(const RulePoints& a, const RulePoints& b,
                                          const RulePoints& c) {
    RuleEdges e;
    e.u = differences_of_products(b.x, c.y, b.y, c.x);
    e.v = differences_of_products(c.x, a.y, c.y, a.x);
    e.w = differences_of_products(a.x, b.y, a.y, b.x);
    e.bound = zero();
    measure_depths(a.z, b.z, c.z, e);
    return e;
}

HWY_INLINE Mask may_be_inside_lanes(const RuleEdges& e) {
    return (min(e.u, min(e.v, e.w)) >= -e.bound) | (max(e.u, max(e.v, e.w)) <= e.bound);
}

HWY_INLINE FloatVec sum_of_sizes(const RuleEdges& e) { return abs(e.u) + abs(e.v) + abs(e.w); }

HWY_INLINE Mask surely_inside_lanes(const RuleRays& rays, const RuleEdges& e) {
    const FloatVec error = e.bound * max(e.depth_range, splat(1.0f));
    const Mask fit = error <= rays.depth_slack * sum_of_sizes(e);
    return fit & ((min(e.u, min(e.v, e.w)) > e.bound) | (max(e.u, max(e.v, e.w)) < -e.bound));
}

// ---- Hits

HWY_INLINE FloatVec scaled_weights(FloatVec weight, FloatVec sum, FloatVec scale) {
    const UintVec gap = shift_right<23>(as_uint(sum)) - shift_right<23>(as_uint(weight));
    const Mask tiny = (weight == zero()) | float_mask(gap > splat(60u));
    return zero_if(tiny, weight * scale);
}

/// weighted_hit: where the sign of t is certain.
HWY_INLINE Mask weighted_hits(const RuleRays& rays, const RuleEdges& e, FloatVec za, FloatVec zb,
                              FloatVec zc, RuleHits& hit) {
    const FloatVec sum = sum_of_sizes(e);
    const Mask any = sum > zero();
    const FloatVec scale = rcp_of_positive(select(any, sum, splat(1.0f)));
    hit.u = scaled_weights(abs(e.v), sum, scale);
    hit.v = scaled_weights(abs(e.w), sum, scale);
    const FloatVec wa = max(splat(1.0f) - (hit.u + hit.v), zero());
    const FloatVec z = wa * za + hit.u * zb + hit.v * zc;
    hit.t = z * rcp_exactly(select(any, rays.dir[2], splat(1.0f)));
    const FloatVec by_range = splat(2.0f) * (e.bound * scale) + splat(kWeightRounding);
    const FloatVec error = by_range * e.depth_range + splat(kMeanRounding) * e.depth_size;
    return (e.depth_range < e.depth_size) | (abs(z) > error);
}

/// Where a hit by exact edge functions is one: inside, not edge-on, and t is certain.
HWY_INLINE Mask exact_hits(const RuleRays& rays, const RuleEdges& e, FloatVec za, FloatVec zb,
                           FloatVec zc, RuleHits& hit) {
    const Mask certain = weighted_hits(rays, e, za, zb, zc, hit);
    const Mask any = sum_of_sizes(e) > zero();
    return certain & (any & may_be_inside_lanes(e));
}

/// is_in_range.
HWY_INLINE Mask in_range(FloatVec t, FloatVec tnear, FloatVec tfar) {
    return (t > zero()) & ((t >= tnear) & (t <= tfar));
}

/// Of vertices with axes rotated or not: all have kInvalidCoordinate on each axis or on none.
HWY_INLINE Mask finite_triangles(FloatVec ax, FloatVec bx, FloatVec cx) {
    return max(ax, max(bx, cx)) <= splat(kSceneExtent);
}

// ---- The rule

/// Rays of any directions with the axes of each rotated.
struct ShearedRays {
    RuleRays rays;
    /// Whether x, or else y, is the largest component of the direction.
    Mask is_x;
    Mask is_y;

    HWY_INLINE void rotate_axes(const FloatVec v[3], FloatVec out[3]) const {
        for (int k = 0; k < 3; ++k) {
            out[k] = select(is_x, v[(k + 1) % 3], select(is_y, v[(k + 2) % 3], v[k]));
        }
    }
};

HWY_INLINE ShearedRays shear_rays(const FloatVec org[3], const FloatVec dir[3]) {
    const FloatVec size[3] = {abs(dir[0]), abs(dir[1]), abs(dir[2])};
    ShearedRays s;
    s.is_x = (size[0] >= size[1]) & (size[0] >= size[2]);
    s.is_y = and_not(s.is_x, size[1] >= size[2]);
    s.rotate_axes(org, s.rays.org);
    s.rotate_axes(dir, s.rays.dir);
    const FloatVec extent = max(max(abs(org[0]), abs(org[1])), abs(org[2]));
    const FloatVec dilation = splat(kBoxDilation) * max(extent, splat(kSceneExtent));
    s.rays.depth_slack = splat(0.25f) * dilation;
    return s;
}

/// What the fast path leaves uncertain of a triangle a lane, and where it is hit:
/// intersect_triangle with `exact_edges`. Vertices have rotated axes.
HWY_INLINE Mask intersect_exactly(const RuleRays& rays, FloatVec tnear, FloatVec tfar,
                                  const FloatVec a[3], const FloatVec b[3], const FloatVec c[3],
                                  RuleHits& hit) {
    const RulePoints pa = project_points(rays, a);
    const RulePoints pb = project_points(rays, b);
    const RulePoints pc = project_points(rays, c);
    const RuleEdges e = exact_edge_functions(pa, pb, pc);
    const Mask hits = exact_hits(rays, e, pa.z, pb.z, pc.z, hit);
    return hits & in_range(hit.t, tnear, tfar) & finite_triangles(a[0], b[0], c[0]);
}

/// intersect_triangle of ray and triangle of each of these lanes; vertices as they are (a[k] is
/// component k). Which of the lanes hit; t, u and v of others are garbage.
HWY_INLINE Mask intersect_triangles(const ShearedRays& sheared, Mask lanes, FloatVec tnear,
                                    FloatVec tfar, const FloatVec a[3], const FloatVec b[3],
                                    const FloatVec c[3], RuleHits& hit) {
    const RuleRays& rays = sheared.rays;
    FloatVec ra[3], rb[3], rc[3];
    sheared.rotate_axes(a, ra);
    sheared.rotate_axes(b, rb);
    sheared.rotate_axes(c, rc);
    const RulePoints pa = project_points_fast(rays, ra);
    const RulePoints pb = project_points_fast(rays, rb);
    const RulePoints pc = project_points_fast(rays, rc);
    const RuleEdges e = fast_edge_functions(pa, pb, pc);
    const Mask certain = weighted_hits(rays, e, pa.z, pb.z, pc.z, hit);
    const Mask sure = surely_inside_lanes(rays, e) & certain;
    Mask hits = in_range(hit.t, tnear, tfar) & (sure & finite_triangles(a[0], b[0], c[0]));
    const Mask open = lanes & and_not(sure, may_be_inside_lanes(e));
    if (!none(open)) {
        RuleHits exact;
        const Mask exact_hits = intersect_exactly(rays, tnear, tfar, ra, rb, rc, exact);
        hits = hits | (open & exact_hits);
        hit.t = select(open, exact.t, hit.t);
        hit.u = select(open, exact.u, hit.u);
        hit.v = select(open, exact.v, hit.v);
    }
    return hits & lanes;
}

}  // namespace HWY_NAMESPACE
}  // namespace morphray::cpu
HWY_AFTER_NAMESPACE();

#endif  // per target
