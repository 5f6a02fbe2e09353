// intersect_triangle (common/interop/hit_rule.h) on vectors: the control flow alone. All arithmetic
// is the shared text (cpu/simd/lanes-inl.h).
#if defined(MORPHRAY_CPU_SIMD_HIT_RULE_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_SIMD_HIT_RULE_INL_H
#undef MORPHRAY_CPU_SIMD_HIT_RULE_INL_H
#else
#define MORPHRAY_CPU_SIMD_HIT_RULE_INL_H
#endif

#include "common/scene_queries.h"
#include "cpu/simd/lanes-inl.h"
#include "cpu/simd/triangle_plane-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu::HWY_NAMESPACE {

struct HitRange {
    FloatVec tnear, tfar;
    Crossing crossing = Crossing::kEach;
};

struct TriangleCorners {
    lanes::Float3 a, b, c;
};

/// The edge functions of the fast path, and the depths of the vertices.
struct FastTriangle {
    lanes::Edges edges;
    FloatVec za, zb, zc;
};

HWY_INLINE void take_hits(Mask lanes, const lanes::TriangleHit& from, lanes::TriangleHit& hit) {
    hit.t = select(lanes, from.t, hit.t);
    hit.u = select(lanes, from.u, hit.u);
    hit.v = select(lanes, from.v, hit.v);
}

/// refine_hit() of these lanes, by pairs alone where doubles do not decide.
HWY_NOINLINE inline void refine_hits(const lanes::ShearedRay& s, const lanes::Edges& e,
                                     const TriangleCorners& t, Mask rough,
                                     lanes::TriangleHit& hit) {
    // Other lanes may hold vertices that are not finite, whose products overflow.
    const auto taken = [&](const lanes::Float3& v) HWY_ATTR {
        const lanes::Float3 r = lanes::rotate_axes(v, s.axis);
        return lanes::Float3(zero_unless(rough, r.x), zero_unless(rough, r.y),
                             zero_unless(rough, r.z));
    };
    const lanes::Float3 a = taken(t.a), b = taken(t.b), c = taken(t.c);
    const auto plane = [&](std::uint32_t part) HWY_ATTR {
        return triangle_plane({s.org, part}, {a, part}, {b, part}, {c, part});
    };
    lanes::TriangleHit refined;
    const Mask is_off_edges = min3(abs(e.u), abs(e.v), abs(e.w)) > zero();
    const Mask is_placed = place_hits(plane, s.dir, bits_of(rough), refined) & is_off_edges;
    if (const Mask left = and_not(is_placed, rough); !none(left)) {
        lanes::TriangleHit exact = hit;
        exact.error = zero_unless(rough, hit.error);
        lanes::refine_hit(s, e, a, b, c, exact);
        take_hits(left, exact, refined);
    }
    take_hits(rough, refined, hit);
}

/// is_refined_in_range() of the lanes `hits`.
HWY_INLINE Mask refined_in_range(const lanes::ShearedRay& s, const lanes::Edges& e,
                                 const HitRange& range, const TriangleCorners& t, Mask hits,
                                 lanes::TriangleHit& hit) {
    const Mask rough = hits & lanes::is_rough(hit);
    if (HWY_UNLIKELY(!none(rough))) {
        const Mask asked = rough & lanes::may_be_in_range(hit, range.tnear, range.tfar) &
                           lanes::finite_vertices(t.a, t.b, t.c);
        if (!none(asked)) refine_hits(s, e, t, asked, hit);
        hits = and_not(rough, hits) | asked;
    }
    return hits & lanes::is_in_range(hit.t, range.tnear, range.tfar);
}

/// The exact path of intersect_triangle, and with kOwner of owns_hit.
HWY_INLINE Mask intersect_exactly(const lanes::ShearedRay& s, const HitRange& range,
                                  const TriangleCorners& t, Mask possible,
                                  lanes::TriangleHit& hit) {
    const lanes::Float3 a = lanes::rotate_axes(t.a, s.axis);
    const lanes::Float3 b = lanes::rotate_axes(t.b, s.axis);
    const lanes::Float3 c = lanes::rotate_axes(t.c, s.axis);
    const lanes::Float3 pa = lanes::project_rotated(s, a);
    const lanes::Float3 pb = lanes::project_rotated(s, b);
    const lanes::Float3 pc = lanes::project_rotated(s, c);
    const lanes::Edges e = lanes::exact_edges(pa, pb, pc);
    Mask hits = lanes::exact_hit(s, e, pa.z, pb.z, pc.z, hit);
    if (range.crossing == Crossing::kOwner) hits = hits & lanes::owns_ray(e, pa, pb, pc);
    return refined_in_range(s, e, range, t, hits & possible, hit);
}

HWY_INLINE vec3 leaf_position(const Leaf& leaf, std::uint32_t triangle, uint i) {
    const LeafVertex& v = leaf.vertex[corner(leaf.vertex[triangle].corners, i)];
    return {v.x, v.y, v.z};
}

HWY_INLINE TriangleCorners corners_in_lanes(const Leaf& leaf, std::uint32_t i) {
    return {lanes::Float3(leaf_position(leaf, i, 0)), lanes::Float3(leaf_position(leaf, i, 1)),
            lanes::Float3(leaf_position(leaf, i, 2))};
}

/// Returns the lanes among `possible`, in which the ray may go through the triangle t, where it
/// hits; t, u and v of other lanes are undefined. The fast path answers where it is certain, the
/// exact path elsewhere.
HWY_INLINE Mask decide_hits(const lanes::ShearedRay& s, const FastTriangle& fast, Mask possible,
                            const HitRange& range, const TriangleCorners& t,
                            lanes::TriangleHit& hit) {
    const Mask is_certain = lanes::weighted_hit(s, fast.edges, fast.za, fast.zb, fast.zc, hit);
    const Mask is_hit = lanes::surely_inside(s, fast.edges) & is_certain;
    Mask hits = refined_in_range(s, fast.edges, range, t, possible & is_hit, hit);
    const Mask uncertain = and_not(is_hit, possible);
    if (!none(uncertain)) {
        lanes::TriangleHit exact;
        hits = hits | intersect_exactly(s, range, t, uncertain, exact);
        take_hits(uncertain, exact, hit);
    }
    return hits & lanes::finite_vertices(t.a, t.b, t.c);
}

/// Returns the active lanes in which the ray hits the triangle; t, u and v of other lanes are
/// undefined.
HWY_INLINE Mask intersect_triangles(const lanes::ShearedRay& s, Mask active, const HitRange& range,
                                    const TriangleCorners& t, lanes::TriangleHit& hit) {
    const auto project = [&s](const lanes::Float3& v) HWY_ATTR {
        return lanes::project_rotated_fast(s, lanes::rotate_axes(v, s.axis));
    };
    const lanes::Float3 pa = project(t.a), pb = project(t.b), pc = project(t.c);
    const FastTriangle fast{lanes::fast_edges(pa, pb, pc), pa.z, pb.z, pc.z};
    return decide_hits(s, fast, active & lanes::may_be_inside(fast.edges), range, t, hit);
}

// ---- Packets

/// Looks up values of a leaf's sixteen vertices for the three vertices of some of its triangles,
/// given their packed local vertex indices.
HWY_INLINE void gather_corners(const float* values, UintVec packed, FloatVec out[3]) {
    const UintVec byte = splat(0xFFu);
    out[0] = LaneLookup(packed & byte)(values);
    out[1] = LaneLookup(shift_right<8>(packed) & byte)(values);
    out[2] = LaneLookup(shift_right<16>(packed) & byte)(values);
}

/// Rays with the same largest axis and positive dir.z, and a triangle in each lane that the ray
/// goes through in front of its origin: the hits of weighted_hit() with edge functions from
/// fast_edges(), in fewer operations. Checked: lab/proofs/fast_hits.g.
struct FastHits {
    /// The part of its own size by which an error of t may differ from that of weighted_hit().
    static constexpr float kErrorRounding = 0x1p-10f;

    /// Surely smooth hits have an error_by_edges of at most this times t.
    static constexpr float kSmoothByEdges = 0x1.7p-14f;
    /// The error of a hit is at least this times extent^2 / sum times the range of z.
    static constexpr float kRoughByExtent = 0x1.7p-19f;

    FloatVec z[3], dz;
    /// The magnitudes of the edge functions.
    FloatVec size[3];
    /// The error of t that the edge functions cause; before weigh() it is times their sum.
    FloatVec error_by_edges;
    /// z of the hit, by weigh().
    FloatVec mean;
    /// The sum of |x| + |y| over the vertices, and where the exact functions have one sign.
    FloatVec extent;
    Mask is_certain;

    /// Computes all but the hits. corner: the vertices relative to the origin, with rotated axes.
    /// Returns the rays for which the rule takes its fast path if the sign of their z is certain.
    HWY_INLINE Mask project(const FloatVec dir[3], FloatVec slack, const FloatVec corner[3][3]) {
        lanes::Float3 p[3];
        dz = dir[2];
        for (int k = 0; k < 3; ++k) {
            p[k] = lanes::project_relative_fast(lanes::Float3(dir), lanes::Float3(corner[k]));
            z[k] = p[k].z;
        }
        size[0] = abs(lanes::fast_edge(p[1], p[2]));
        size[1] = abs(lanes::fast_edge(p[2], p[0]));
        size[2] = abs(lanes::fast_edge(p[0], p[1]));
        const FloatVec m = sum3(lanes::projected_size(p[0]), lanes::projected_size(p[1]),
                                lanes::projected_size(p[2]));
        const FloatVec depth_range = farthest() - nearest();
        // edge_bound(), fused or not: 2^-18 more than makes up for the difference.
        const FloatVec r = mul_add(splat(kFastProjectionError * (1 + 0x1p-18f)),
                                   mul_add(splat(2.0f), m, depth_size()),
                                   splat(kFastProjectionFloor * (1 + 0x1p-18f)));
        const FloatVec bound = r * mul_add(splat(2.0f), r, m);
        const Mask is_flat = bound * lanes::greater(depth_range, 1.0f) <= slack * sum();
        error_by_edges = splat(6.0f) * bound * depth_range;
        // The exact functions have one sign, and so have these where they exceed their bound.
        is_certain = min3(size[0], size[1], size[2]) > bound;
        extent = m;
        return is_flat & is_certain;
    }

    /// Sets t, u and v. scaled_weight() drops nothing here: functions that suffice
    /// exceed the bound, and so 2^-20 m^2, and their sum is at most 2 m^2.
    HWY_INLINE void weigh(FloatVec& t, FloatVec& u, FloatVec& v) {
        const FloatVec scale = lanes::rcp_of_positive(sum());
        u = size[1] * scale;
        v = size[2] * scale;
        const FloatVec wa = max(1.0f - (u + v), zero());
        const FloatVec weighted = wa * z[0] + u * z[1] + v * z[2];
        mean = lanes::lesser(lanes::greater(weighted, nearest()), farthest());
        t = mean * lanes::rcp_of_positive(dz);
        error_by_edges = error_by_edges * scale;
    }

    /// True only where the hit is smooth and all vertices are in front of the origin. Cheaper than
    /// find_rough(), and true for most triangles.
    HWY_INLINE Mask is_surely_smooth(FloatVec t) const {
        return (farthest() - nearest() < splat(0.25f) * mean) &
               (error_by_edges <= splat(kSmoothByEdges) * t);
    }

    /// Sets which hits have a t that is accurate for certain, and which are rough for certain.
    HWY_INLINE void find_rough(FloatVec t, Mask& is_smooth, Mask& is_rough) const {
        const FloatVec range = farthest() - nearest();
        const FloatVec error = error_by_edges + splat(kHitRounding) * (range + depth_size());
        const FloatVec allowed = lanes::allowed_error(range, mean, t);
        is_smooth = error <= splat(1 - kErrorRounding) * allowed;
        is_rough = error > splat(1 + kErrorRounding) * allowed;
    }

    /// True only for hits of large triangles that are rough whichever path the rule takes:
    /// real_bound grows with their extent.
    HWY_INLINE Mask is_surely_rough(FloatVec t) const {
        const FloatVec most_t =
            mul_add(splat(0x1p-18f), depth_size(), abs(t) + error_by_edges) * sum();
        const FloatVec least_error =
            splat(kRoughByExtent) * extent * extent * (farthest() - nearest());
        return is_certain & (extent > mul_add(splat(0x1p-10f), depth_size(), splat(0x1p-30f))) &
               (least_error > splat((1 + kErrorRounding) * kRoughSlope) * most_t);
    }

    /// Returns the rays for which project() returned true and whose z is certainly positive: all z
    /// are, and their range is less than the farthest, or it is so beyond its error.
    HWY_INLINE Mask is_hit_ahead(FloatVec slack) const {
        // `error` of weighted_hit() is no larger: is_flat limits its part by the bound, and the
        // range is at most twice the size.
        constexpr float kErrorOfSize = (2 * kWeightRounding + kMeanRounding) * (1 + 0x1p-18f);
        return (nearest() > 0x1p-20f * farthest()) |
               (mean >
                mul_add(splat(kErrorOfSize), depth_size(), splat(2 * (1 + 0x1p-18f)) * slack));
    }

private:
    HWY_INLINE FloatVec nearest() const { return min3(z[0], z[1], z[2]); }
    HWY_INLINE FloatVec farthest() const { return max3(z[0], z[1], z[2]); }
    HWY_INLINE FloatVec depth_size() const { return max(farthest(), -nearest()); }
    HWY_INLINE FloatVec sum() const { return sum3(size[0], size[1], size[2]); }
};

/// Triangles of rays that the bounds of a packet leave uncertain, a lane each. corner[k][axis] are
/// the coordinates of corner k.
struct TriangleLanes {
    FloatVec corner[3][3];
    UintVec prim_ids;

    HWY_INLINE void take(Mask own, const TriangleLanes& others) {
        for (int k = 0; k < 3; ++k) {
            for (int axis = 0; axis < 3; ++axis)
                corner[k][axis] = select(own, others.corner[k][axis], corner[k][axis]);
        }
        prim_ids = select(uint_mask(own), others.prim_ids, prim_ids);
    }
};

/// Returns which of the lanes are hit from tnear = 0 up to tfar, and sets where.
HWY_INLINE Mask intersect_triangles(const lanes::ShearedRay& rays, const TriangleLanes& triangles,
                                    FloatVec tfar, std::uint32_t lanes, lanes::TriangleHit& hits) {
    const TriangleCorners corners{lanes::Float3(triangles.corner[0]),
                                  lanes::Float3(triangles.corner[1]),
                                  lanes::Float3(triangles.corner[2])};
    return intersect_triangles(rays, mask_of(lanes), {zero(), tfar}, corners, hits);
}

}  // namespace mray::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per target
