// One ray against the triangles of a leaf, by the hit rule and with its bits.
//
// The plain path goes first, in the operations of project_fast and fast_edges. A triangle is left
// out if may_be_inside is false, or if its hit would certainly lie behind the ray's origin, which
// is so for the triangle that a secondary ray starts from, the most frequent one of all. For those
// that are left the plain path answers where it may, then the exact one.
//
// Behind the origin (proofs/near.g). Let e be the triangle's edge functions as fast_edges gives
// them, bound as there, z the vertices' z, Z the largest |z|, S the sum of the |e|, and N = sum of
// |e| * z. Let E be the magnitudes of the accurate edge functions, |E - |e|| <= bound. A hit has a
// z of certain sign (docs/design/arithmetic.md, "In front"), so that sum of E * z has the sign of
// dir.z. But
//     sum of E * z <= N + 3 bound Z,
// and N as computed is off by at most 3 * 2^-24 S Z. So if N + Z * (kBehindError S + 4 bound) is
// negative, a ray with a positive direction along z does not hit the triangle; with a negative
// direction the same holds for -z. N is below 2^127 for vertices within kSceneExtent and any
// origin. Products may underflow here, unlike in the rule: three in N, by 2^-126 each, and in the
// right side kBehindError S and the product with Z, of which the first does not matter to a bound
// of at least 2^-97. So kBehindUnderflow is added.
#if defined(MORPHRAY_CPU_SINGLE_RAY_LEAF_HIT_RULE_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_SINGLE_RAY_LEAF_HIT_RULE_INL_H
#undef MORPHRAY_CPU_SINGLE_RAY_LEAF_HIT_RULE_INL_H
#else
#define MORPHRAY_CPU_SINGLE_RAY_LEAF_HIT_RULE_INL_H
#endif

#include <bit>
#include <cstddef>
#include <cstdint>

#include "common/interop/hit_rule.h"
#include "common/interop/packet_bounds.h"
#include "cpu/simd/exact_hit_rule-inl.h"
#include "cpu/single_ray/leaf_lanes-inl.h"
#include "cpu/single_ray/ray_stream-inl.h"

HWY_BEFORE_NAMESPACE();
namespace morphray::cpu {
namespace HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

#if HWY_TARGET == HWY_SCALAR

/// Calls visit(slot, hit) for the triangles that the ray hits no later than tfar, until it returns
/// true; whether it did.
template <class Visit>
HWY_INLINE bool intersect_leaf(const RayStream& stream, std::size_t ray, float tfar,
                               const Leaf& leaf, Visit visit) {
    ShearedRay s;
    for (int k = 0; k < 3; ++k) {
        s.org[k] = stream.sheared_org[k][ray];
        s.dir[k] = stream.sheared_dir[k][ray];
    }
    s.axis = stream.axis[ray];
    s.depth_slack = stream.depth_slack[ray];
    const std::uint32_t count = corner_triangle_count(leaf.vertex[0].corners);
    for (std::uint32_t slot = 0; slot < count; ++slot) {
        const vec3 a = leaf_position(leaf, slot, 0);
        const vec3 b = leaf_position(leaf, slot, 1);
        const vec3 c = leaf_position(leaf, slot, 2);
        TriangleHit hit;
        if (may_hit_triangle(s, a, b, c) &&
            intersect_triangle(s, stream.tnear[ray], tfar, a, b, c, hit) && visit(slot, hit)) {
            return true;
        }
    }
    return false;
}

#else

/// The leaf's vertices as the ray sees them, and the |x| + |y| of the plain path.
struct LeafPoints {
    VertexValues x;
    VertexValues y;
    VertexValues z;
    VertexValues size;
};

HWY_INLINE LeafPoints project_leaf_fast(const RuleRays& ray, const LeafLanes& lanes) {
    LeafPoints points;
    for (std::size_t v = 0; v < kVectors; ++v) {
        const FloatVec vertices[3] = {lanes.x[v], lanes.y[v], lanes.z[v]};
        const RulePoints p = project_points_fast(ray, vertices);
        points.x.set(v, p.x);
        points.y.set(v, p.y);
        points.z.set(v, p.z);
        points.size.set(v, abs(p.x) + abs(p.y));
    }
    return points;
}

/// A vector of triangles as the ray sees them.
struct FilteredTriangles {
    RuleEdges edges;
    FloatVec za;
    FloatVec zb;
    FloatVec zc;
};

/// fast_edges, with the sizes of the vertices taken from where they are.
HWY_INLINE FilteredTriangles fast_triangles(const LeafPoints& points, const CornerGathers& at) {
    const FloatVec ax = points.x.look_up(at.a), ay = points.y.look_up(at.a);
    const FloatVec bx = points.x.look_up(at.b), by = points.y.look_up(at.b);
    const FloatVec cx = points.x.look_up(at.c), cy = points.y.look_up(at.c);
    FilteredTriangles t;
    t.za = points.z.look_up(at.a);
    t.zb = points.z.look_up(at.b);
    t.zc = points.z.look_up(at.c);
    measure_depths(t.za, t.zb, t.zc, t.edges);
    const FloatVec m =
        sum3(points.size.look_up(at.a), points.size.look_up(at.b), points.size.look_up(at.c));
    t.edges.bound = edge_bounds(m, t.edges.depth_size);
    t.edges.u = difference(bx, cy, by, cx);
    t.edges.v = difference(cx, ay, cy, ax);
    t.edges.w = difference(ax, by, ay, bx);
    return t;
}

// More than what underflow takes from the products there: 2^-120.
inline constexpr float kBehindUnderflow = 0x1p-120f;

/// Which of the triangles may be hit; dz of the ray.
HWY_INLINE Mask possible_lanes(const FilteredTriangles& t, FloatVec dz) {
    const RuleEdges& e = t.edges;
    const FloatVec au = abs(e.u), av = abs(e.v), aw = abs(e.w);
    // Fused or not: this decides no hit.
    const FloatVec n = mul_add(aw, t.zc, mul_add(av, t.zb, au * t.za));
    const FloatVec error = mul_add(splat(kBehindError), sum3(au, av, aw), splat(4.0f) * e.bound);
    const FloatVec slack = mul_add(e.depth_size, error, splat(kBehindUnderflow));
    const FloatVec away = dz & splat(-0.0f);
    return may_be_inside_lanes(e) & ((n ^ away) >= -slack);
}

/// The lanes of vector v that are triangles.
HWY_INLINE Mask used_lanes(UintVec corners, std::size_t v) {
    return float_mask(slots_of_vector(v) < shift_right<24>(corners));
}

HWY_INLINE Mask finite_lanes(const LeafLanes& lanes, const CornerGathers& at) {
    VertexValues x;
    for (std::size_t v = 0; v < kVectors; ++v) x.set(v, lanes.x[v]);
    return finite_triangles(x.look_up(at.a), x.look_up(at.b), x.look_up(at.c));
}

/// visit(slot, hit) for these lanes of vector v, until it returns true; whether it did.
template <class Visit>
HWY_INLINE bool visit_lanes(std::size_t v, Mask lanes, const RuleHits& hits, Visit& visit) {
    HWY_ALIGN float t[kLanes];
    HWY_ALIGN float u[kLanes];
    HWY_ALIGN float w[kLanes];
    store(hits.t, t);
    store(hits.u, u);
    store(hits.v, w);
    for (std::uint32_t bits = bits_of(lanes); bits != 0; bits &= bits - 1) {
        const auto i = static_cast<std::uint32_t>(std::countr_zero(bits));
        const auto first = static_cast<std::uint32_t>(v * kLanes);
        if (visit(slot_of_lane(first + i), TriangleHit{t[i], u[i], w[i]})) return true;
    }
    return false;
}

/// The exact path for the triangles of these lanes.
template <class Visit>
HWY_NOINLINE bool intersect_leaf_exactly(const RayStream& stream, std::size_t ray, float tfar,
                                         const Leaf& leaf, std::uint32_t open, Visit visit) {
    const LeafLanes lanes = load_leaf(leaf, stream.axis[ray]);
    const RuleRays rays = rule_ray(stream, ray);
    LeafPoints points;
    for (std::size_t v = 0; v < kVectors; ++v) {
        const FloatVec vertices[3] = {lanes.x[v], lanes.y[v], lanes.z[v]};
        const RulePoints p = project_points(rays, vertices);
        points.x.set(v, p.x);
        points.y.set(v, p.y);
        points.z.set(v, p.z);
    }
    for (std::size_t v = 0; v < kVectors; ++v) {
        const std::uint32_t bits = open >> (v * kLanes) & kLaneBits;
        if (bits == 0) continue;
        const CornerGathers at(lanes.corners[v]);
        const RulePoints a{points.x.look_up(at.a), points.y.look_up(at.a), points.z.look_up(at.a)};
        const RulePoints b{points.x.look_up(at.b), points.y.look_up(at.b), points.z.look_up(at.b)};
        const RulePoints c{points.x.look_up(at.c), points.y.look_up(at.c), points.z.look_up(at.c)};
        RuleHits hit;
        Mask hits = exact_hits(rays, exact_edge_functions(a, b, c), a.z, b.z, c.z, hit);
        hits = hits & in_range(hit.t, splat(stream.tnear[ray]), splat(tfar));
        hits = hits & mask_of(bits);
        if (none(hits)) continue;
        if (visit_lanes(v, hits & finite_lanes(lanes, at), hit, visit)) return true;
    }
    return false;
}

/// Calls visit(slot, hit) for the triangles that the ray hits no later than tfar, until it returns
/// true; whether it did.
template <class Visit>
HWY_INLINE bool intersect_leaf(const RayStream& stream, std::size_t ray, float tfar,
                               const Leaf& leaf, Visit visit) {
    const LeafLanes lanes = load_leaf(leaf, stream.axis[ray]);
    const RuleRays rays = rule_ray(stream, ray);
    const LeafPoints points = project_leaf_fast(rays, lanes);
    std::uint32_t open = 0;
    for (std::size_t v = 0; v < kVectors; ++v) {
        const CornerGathers at(lanes.corners[v]);
        const FilteredTriangles t = fast_triangles(points, at);
        const Mask possible = possible_lanes(t, rays.dir[2]) & used_lanes(lanes.corners[v], v);
        if (none(possible)) continue;
        RuleHits hit;
        const Mask certain = weighted_hits(rays, t.edges, t.za, t.zb, t.zc, hit);
        const Mask sure = certain & surely_inside_lanes(rays, t.edges);
        const Mask reached = in_range(hit.t, splat(stream.tnear[ray]), splat(tfar));
        const Mask hits = possible & sure & reached;
        if (!none(hits) && visit_lanes(v, hits & finite_lanes(lanes, at), hit, visit)) {
            return true;
        }
        open |= bits_of(and_not(sure, possible)) << (v * kLanes);
    }
    return open != 0 && intersect_leaf_exactly(stream, ray, tfar, leaf, open, visit);
}

#endif  // HWY_TARGET

}  // namespace HWY_NAMESPACE
}  // namespace morphray::cpu
HWY_AFTER_NAMESPACE();

#endif  // per target
