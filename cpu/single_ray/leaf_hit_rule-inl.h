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
        points.size.set(v, hn::Add(hn::Abs(p.x), hn::Abs(p.y)));
    }
    return points;
}

/// A vector of triangles as the ray sees them.
struct TriangleLanes {
    RuleEdges edges;
    FloatVec za;
    FloatVec zb;
    FloatVec zc;
};

/// fast_edges, with the sizes of the vertices taken from where they are.
HWY_INLINE TriangleLanes plain_triangles(const LeafPoints& points, const CornerGathers& at) {
    const FloatVec ax = at.a(points.x), ay = at.a(points.y);
    const FloatVec bx = at.b(points.x), by = at.b(points.y);
    const FloatVec cx = at.c(points.x), cy = at.c(points.y);
    TriangleLanes t;
    t.za = at.a(points.z);
    t.zb = at.b(points.z);
    t.zc = at.c(points.z);
    measure_depths(t.za, t.zb, t.zc, t.edges);
    const FloatVec m = sum3(at.a(points.size), at.b(points.size), at.c(points.size));
    t.edges.bound = edge_bounds(m, t.edges.depth_size);
    t.edges.u = difference(bx, cy, by, cx);
    t.edges.v = difference(cx, ay, cy, ax);
    t.edges.w = difference(ax, by, ay, bx);
    return t;
}

// More than what underflow takes from the products there: 2^-120.
inline constexpr float kBehindUnderflow = 0x1p-120f;

/// Which of the triangles may be hit; dz of the ray.
HWY_INLINE FloatMask possible_lanes(const TriangleLanes& t, FloatVec dz) {
    const RuleEdges& e = t.edges;
    const FloatVec au = hn::Abs(e.u), av = hn::Abs(e.v), aw = hn::Abs(e.w);
    // Fused or not: this decides no hit.
    const FloatVec n = hn::MulAdd(aw, t.zc, hn::MulAdd(av, t.zb, hn::Mul(au, t.za)));
    const FloatVec error =
        hn::MulAdd(broadcast(kBehindError), sum3(au, av, aw), hn::Mul(broadcast(4.0f), e.bound));
    const FloatVec slack = hn::MulAdd(e.depth_size, error, broadcast(kBehindUnderflow));
    const FloatVec away = hn::And(dz, broadcast(-0.0f));
    return hn::And(may_be_inside_lanes(e), hn::Ge(hn::Xor(n, away), hn::Neg(slack)));
}

/// The lanes of vector v that are triangles.
HWY_INLINE FloatMask used_lanes(UintVec corners, std::size_t v) {
    return hn::RebindMask(kFloats, hn::Lt(slots_of_vector(v), hn::ShiftRight<24>(corners)));
}

HWY_INLINE FloatMask finite_lanes(const LeafLanes& lanes, const CornerGathers& at) {
    VertexValues x;
    for (std::size_t v = 0; v < kVectors; ++v) x.set(v, lanes.x[v]);
    return finite_triangles(at.a(x), at.b(x), at.c(x));
}

/// visit(slot, hit) for these lanes of vector v, until it returns true; whether it did.
template <class Visit>
HWY_INLINE bool visit_lanes(std::size_t v, FloatMask lanes, const RuleHits& hits, Visit& visit) {
    HWY_ALIGN float t[kLanes];
    HWY_ALIGN float u[kLanes];
    HWY_ALIGN float w[kLanes];
    hn::Store(hits.t, kFloats, t);
    hn::Store(hits.u, kFloats, u);
    hn::Store(hits.v, kFloats, w);
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
        const RulePoints a{at.a(points.x), at.a(points.y), at.a(points.z)};
        const RulePoints b{at.b(points.x), at.b(points.y), at.b(points.z)};
        const RulePoints c{at.c(points.x), at.c(points.y), at.c(points.z)};
        RuleHits hit;
        FloatMask hits = exact_hits(rays, exact_edge_functions(a, b, c), a.z, b.z, c.z, hit);
        hits = hn::And(hits, in_range(hit.t, broadcast(stream.tnear[ray]), broadcast(tfar)));
        hits = hn::And(hits, mask_of(bits));
        if (hn::AllFalse(kFloats, hits)) continue;
        if (visit_lanes(v, hn::And(hits, finite_lanes(lanes, at)), hit, visit)) return true;
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
        const TriangleLanes t = plain_triangles(points, at);
        const FloatMask possible =
            hn::And(possible_lanes(t, rays.dir[2]), used_lanes(lanes.corners[v], v));
        if (hn::AllFalse(kFloats, possible)) continue;
        RuleHits hit;
        const FloatMask certain = weighted_hits(rays, t.edges, t.za, t.zb, t.zc, hit);
        const FloatMask sure = hn::And(certain, surely_inside_lanes(rays, t.edges));
        const FloatMask reached = in_range(hit.t, broadcast(stream.tnear[ray]), broadcast(tfar));
        const FloatMask hits = hn::And(hn::And(possible, sure), reached);
        if (!hn::AllFalse(kFloats, hits) &&
            visit_lanes(v, hn::And(hits, finite_lanes(lanes, at)), hit, visit)) {
            return true;
        }
        open |= bits_of(hn::AndNot(sure, possible)) << (v * kLanes);
    }
    return open != 0 && intersect_leaf_exactly(stream, ray, tfar, leaf, open, visit);
}

#endif  // HWY_TARGET

}  // namespace HWY_NAMESPACE
}  // namespace morphray::cpu
HWY_AFTER_NAMESPACE();

#endif  // per target
