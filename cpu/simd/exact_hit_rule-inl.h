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
#include "cpu/simd/rule_vectors-inl.h"

HWY_BEFORE_NAMESPACE();
namespace morphray::cpu {
namespace HWY_NAMESPACE {

/// What the rule needs of rays, a lane each, with rotated axes.
struct RuleRays {
    VF org[3];
    VF dir[3];
    VF depth_slack;
};

/// Vertices as rays see them, a lane each.
struct RulePoints {
    VF x;
    VF y;
    VF z;
};

struct RuleEdges {
    VF u;
    VF v;
    VF w;
    VF bound;
    VF depth_range;
    VF depth_size;
};

struct RuleHits {
    VF t;
    VF u;
    VF v;
};

// ---- Exact errors

HWY_INLINE VF product_errors(VF a, VF b, VF p) {
#if HWY_NATIVE_FMA
    return hn::MulSub(a, b, p);
#else
    const VF ca = hn::Mul(splat(4097.0f), a);
    const VF cb = hn::Mul(splat(4097.0f), b);
    const VF ah = hn::Sub(ca, hn::Sub(ca, a));
    const VF bh = hn::Sub(cb, hn::Sub(cb, b));
    const VF al = hn::Sub(a, ah);
    const VF bl = hn::Sub(b, bh);
    const VF e0 = hn::Sub(hn::Mul(ah, bh), p);
    const VF e1 = hn::Add(e0, hn::Mul(ah, bl));
    const VF e2 = hn::Add(e1, hn::Mul(al, bh));
    return hn::Add(e2, hn::Mul(al, bl));
#endif
}

HWY_INLINE VF difference_errors(VF a, VF b, VF d) {
    const VF bv = hn::Sub(a, d);
    const VF av = hn::Add(d, bv);
    return hn::Add(hn::Sub(bv, b), hn::Sub(a, av));
}

HWY_INLINE VF differences_of_products(VF a, VF b, VF c, VF d) {
    const VF left = hn::Mul(a, b);
    const VF right = hn::Mul(c, d);
    const VF major = hn::Sub(left, right);
    const VF minor = hn::Sub(product_errors(a, b, left), product_errors(c, d, right));
    const VF sum = hn::Add(major, minor);
    return hn::IfThenElse(hn::Eq(sum, hn::Zero(Floats())), major, sum);
}

// ---- Projection

/// The vertices relative to the origins as rounded differences, and the errors of those.
struct RelativeVertices {
    VF a[3];
    VF error[3];
};

HWY_INLINE RelativeVertices relative_vertices(const RuleRays& rays, const VF vertex[3]) {
    RelativeVertices r;
    for (int k = 0; k < 3; ++k) {
        r.a[k] = hn::Sub(vertex[k], rays.org[k]);
        r.error[k] = difference_errors(vertex[k], rays.org[k], r.a[k]);
    }
    return r;
}

/// project_axis for x (k = 0) or y (k = 1).
HWY_INLINE VF project_axes(const RuleRays& rays, const RelativeVertices& r, int k) {
    const VF major = differences_of_products(r.a[k], rays.dir[2], rays.dir[k], r.a[2]);
    const VF left = hn::Mul(r.error[k], rays.dir[2]);
    const VF right = hn::Mul(rays.dir[k], r.error[2]);
    const VF sum = hn::Add(major, hn::Sub(left, right));
    const VF snapped = hn::Sub(hn::Add(sum, splat(kProjectedSnap)), splat(kProjectedSnap));
    return hn::IfThenElse(hn::Ge(hn::Abs(sum), splat(kProjectedOnGrid)), sum, snapped);
}

/// `project` of vertices with rotated axes.
HWY_INLINE RulePoints project_points(const RuleRays& rays, const VF vertex[3]) {
    const RelativeVertices r = relative_vertices(rays, vertex);
    return {project_axes(rays, r, 0), project_axes(rays, r, 1), r.a[2]};
}

/// `project_fast` of vertices with rotated axes.
HWY_INLINE RulePoints project_points_fast(const RuleRays& rays, const VF vertex[3]) {
    VF a[3];
    for (int k = 0; k < 3; ++k) a[k] = hn::Sub(vertex[k], rays.org[k]);
    const auto axis = [&](int k) {
        return hn::Sub(hn::Mul(a[k], rays.dir[2]), hn::Mul(rays.dir[k], a[2]));
    };
    return {axis(0), axis(1), a[2]};
}

// ---- Edge functions

HWY_INLINE void measure_depths(VF za, VF zb, VF zc, RuleEdges& e) {
    const VF nearest = hn::Min(za, hn::Min(zb, zc));
    const VF farthest = hn::Max(za, hn::Max(zb, zc));
    e.depth_range = hn::Sub(farthest, nearest);
    e.depth_size = hn::Max(hn::Abs(nearest), hn::Abs(farthest));
}

/// The bound of fast_edges, from the sum of |x| + |y| and the largest |z| of a triangle.
HWY_INLINE VF edge_bounds(VF m, VF depth_size) {
    const VF size = hn::Add(hn::Add(m, m), depth_size);
    const VF r = hn::Add(hn::Mul(splat(kFastProjectionError), size), splat(kFastProjectionFloor));
    return hn::Mul(r, hn::Add(m, hn::Add(r, r)));
}

HWY_INLINE RuleEdges fast_edge_functions(const RulePoints& a, const RulePoints& b,
                                         const RulePoints& c) {
    const auto size = [](const RulePoints& p) { return hn::Add(hn::Abs(p.x), hn::Abs(p.y)); };
    const auto edge = [](const RulePoints& p, const RulePoints& q) {
        return hn::Sub(hn::Mul(p.x, q.y), hn::Mul(p.y, q.x));
    };
    RuleEdges e;
    measure_depths(a.z, b.z, c.z, e);
    const VF m = hn::Add(hn::Add(size(a), size(b)), size(c));
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
    e.bound = hn::Zero(Floats());
    measure_depths(a.z, b.z, c.z, e);
    return e;
}

HWY_INLINE Mask may_be_inside_lanes(const RuleEdges& e) {
    return hn::Or(hn::Ge(hn::Min(e.u, hn::Min(e.v, e.w)), hn::Neg(e.bound)),
                  hn::Le(hn::Max(e.u, hn::Max(e.v, e.w)), e.bound));
}

HWY_INLINE VF sum_of_sizes(const RuleEdges& e) {
    return hn::Add(hn::Add(hn::Abs(e.u), hn::Abs(e.v)), hn::Abs(e.w));
}

HWY_INLINE Mask surely_inside_lanes(const RuleRays& rays, const RuleEdges& e) {
    const VF error = hn::Mul(e.bound, hn::Max(e.depth_range, splat(1.0f)));
    const Mask fit = hn::Le(error, hn::Mul(rays.depth_slack, sum_of_sizes(e)));
    return hn::And(fit, hn::Or(hn::Gt(hn::Min(e.u, hn::Min(e.v, e.w)), e.bound),
                               hn::Lt(hn::Max(e.u, hn::Max(e.v, e.w)), hn::Neg(e.bound))));
}

// ---- Hits

HWY_INLINE VF scaled_weights(VF weight, VF sum, VF scale) {
    const Floats f;
    const Words w;
    const VW gap = hn::Sub(hn::ShiftRight<23>(hn::BitCast(w, sum)),
                           hn::ShiftRight<23>(hn::BitCast(w, weight)));
    const Mask tiny =
        hn::Or(hn::Eq(weight, hn::Zero(f)), hn::RebindMask(f, hn::Gt(gap, hn::Set(w, 60u))));
    return hn::IfThenZeroElse(tiny, hn::Mul(weight, scale));
}

/// weighted_hit: where the sign of t is certain.
HWY_INLINE Mask weighted_hits(const RuleRays& rays, const RuleEdges& e, VF za, VF zb, VF zc,
                              RuleHits& hit) {
    const VF zero = hn::Zero(Floats());
    const VF sum = sum_of_sizes(e);
    const Mask any = hn::Gt(sum, zero);
    const VF scale = rcp_of_positive(hn::IfThenElse(any, sum, splat(1.0f)));
    hit.u = scaled_weights(hn::Abs(e.v), sum, scale);
    hit.v = scaled_weights(hn::Abs(e.w), sum, scale);
    const VF wa = hn::Max(hn::Sub(splat(1.0f), hn::Add(hit.u, hit.v)), zero);
    const VF z = hn::Add(hn::Add(hn::Mul(wa, za), hn::Mul(hit.u, zb)), hn::Mul(hit.v, zc));
    hit.t = hn::Mul(z, rcp_exactly(hn::IfThenElse(any, rays.dir[2], splat(1.0f))));
    const VF by_range =
        hn::Add(hn::Mul(splat(2.0f), hn::Mul(e.bound, scale)), splat(kWeightRounding));
    const VF error =
        hn::Add(hn::Mul(by_range, e.depth_range), hn::Mul(splat(kMeanRounding), e.depth_size));
    return hn::Or(hn::Lt(e.depth_range, e.depth_size), hn::Gt(hn::Abs(z), error));
}

/// Where a hit by exact edge functions is one: inside, not edge-on, and t is certain.
HWY_INLINE Mask exact_hits(const RuleRays& rays, const RuleEdges& e, VF za, VF zb, VF zc,
                           RuleHits& hit) {
    const Mask certain = weighted_hits(rays, e, za, zb, zc, hit);
    const Mask any = hn::Gt(sum_of_sizes(e), hn::Zero(Floats()));
    return hn::And(certain, hn::And(any, may_be_inside_lanes(e)));
}

/// is_in_range.
HWY_INLINE Mask in_range(VF t, VF tnear, VF tfar) {
    return hn::And(hn::Gt(t, hn::Zero(Floats())), hn::And(hn::Ge(t, tnear), hn::Le(t, tfar)));
}

/// Of vertices with axes rotated or not: all have kInvalidCoordinate on each axis or on none.
HWY_INLINE Mask finite_triangles(VF ax, VF bx, VF cx) {
    return hn::Le(hn::Max(ax, hn::Max(bx, cx)), splat(kSceneExtent));
}

// ---- The rule

/// Rays of any directions with the axes of each rotated.
struct ShearedRays {
    RuleRays rays;
    /// Whether x, or else y, is the largest component of the direction.
    Mask is_x;
    Mask is_y;

    HWY_INLINE void rotate_axes(const VF v[3], VF out[3]) const {
        for (int k = 0; k < 3; ++k) {
            out[k] =
                hn::IfThenElse(is_x, v[(k + 1) % 3], hn::IfThenElse(is_y, v[(k + 2) % 3], v[k]));
        }
    }
};

HWY_INLINE ShearedRays shear_rays(const VF org[3], const VF dir[3]) {
    const VF size[3] = {hn::Abs(dir[0]), hn::Abs(dir[1]), hn::Abs(dir[2])};
    ShearedRays s;
    s.is_x = hn::And(hn::Ge(size[0], size[1]), hn::Ge(size[0], size[2]));
    s.is_y = hn::AndNot(s.is_x, hn::Ge(size[1], size[2]));
    s.rotate_axes(org, s.rays.org);
    s.rotate_axes(dir, s.rays.dir);
    const VF extent = hn::Max(hn::Max(hn::Abs(org[0]), hn::Abs(org[1])), hn::Abs(org[2]));
    const VF dilation = hn::Mul(splat(kBoxDilation), hn::Max(extent, splat(kSceneExtent)));
    s.rays.depth_slack = hn::Mul(splat(0.25f), dilation);
    return s;
}

/// What the fast path leaves uncertain of a triangle a lane, and where it is hit:
/// intersect_triangle with `exact_edges`. Vertices have rotated axes.
HWY_INLINE Mask intersect_exactly(const RuleRays& rays, VF tnear, VF tfar, const VF a[3],
                                  const VF b[3], const VF c[3], RuleHits& hit) {
    const RulePoints pa = project_points(rays, a);
    const RulePoints pb = project_points(rays, b);
    const RulePoints pc = project_points(rays, c);
    const RuleEdges e = exact_edge_functions(pa, pb, pc);
    const Mask hits = exact_hits(rays, e, pa.z, pb.z, pc.z, hit);
    return hn::And(hn::And(hits, in_range(hit.t, tnear, tfar)), finite_triangles(a[0], b[0], c[0]));
}

/// intersect_triangle of ray and triangle of each of these lanes; vertices as they are (a[k] is
/// component k). Which of the lanes hit; t, u and v of others are garbage.
HWY_INLINE Mask intersect_triangles(const ShearedRays& sheared, Mask lanes, VF tnear, VF tfar,
                                    const VF a[3], const VF b[3], const VF c[3], RuleHits& hit) {
    const Floats f;
    const RuleRays& rays = sheared.rays;
    VF ra[3], rb[3], rc[3];
    sheared.rotate_axes(a, ra);
    sheared.rotate_axes(b, rb);
    sheared.rotate_axes(c, rc);
    const RulePoints pa = project_points_fast(rays, ra);
    const RulePoints pb = project_points_fast(rays, rb);
    const RulePoints pc = project_points_fast(rays, rc);
    const RuleEdges e = fast_edge_functions(pa, pb, pc);
    const Mask certain = weighted_hits(rays, e, pa.z, pb.z, pc.z, hit);
    const Mask sure = hn::And(surely_inside_lanes(rays, e), certain);
    Mask hits =
        hn::And(in_range(hit.t, tnear, tfar), hn::And(sure, finite_triangles(a[0], b[0], c[0])));
    const Mask open = hn::And(lanes, hn::AndNot(sure, may_be_inside_lanes(e)));
    if (!hn::AllFalse(f, open)) {
        RuleHits exact;
        const Mask exact_hits = intersect_exactly(rays, tnear, tfar, ra, rb, rc, exact);
        hits = hn::Or(hits, hn::And(open, exact_hits));
        hit.t = hn::IfThenElse(open, exact.t, hit.t);
        hit.u = hn::IfThenElse(open, exact.u, hit.u);
        hit.v = hn::IfThenElse(open, exact.v, hit.v);
    }
    return hn::And(hits, lanes);
}

}  // namespace HWY_NAMESPACE
}  // namespace morphray::cpu
HWY_AFTER_NAMESPACE();

#endif  // per target
