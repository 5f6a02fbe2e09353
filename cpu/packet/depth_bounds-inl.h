// Bounds of how far the hit rule may place a hit from the plane of its triangle, for packets.

#if defined(MORPHRAY_CPU_PACKET_DEPTH_BOUNDS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_PACKET_DEPTH_BOUNDS_INL_H
#undef MORPHRAY_CPU_PACKET_DEPTH_BOUNDS_INL_H
#else
#define MORPHRAY_CPU_PACKET_DEPTH_BOUNDS_INL_H
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cstdint>

#include "common/interop/hit_rule.h"
#include "common/interop/packet_bounds.h"
#include "cpu/packet/packet_frame.h"
#include "cpu/packet/packet_triangles-inl.h"
#include "cpu/simd/fast_hit_rule-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {

/// How far the rule may place a hit from the plane of a triangle: by_q * q + by_q2 * q^2 in q =
/// 1/z, and at most `z` in z.
struct RuleDepth {
    FloatVec by_q, by_q2, z;
};

/// Finds RuleDepth. kOnGrid: the packet is a camera packet.
template <bool kOnGrid>
class DepthBounds {
public:
    explicit DepthBounds(const PacketFrame& frame) : frame_(frame) {}

    /// scale: 1 / |det|. fits: the triangles that are in front of the origin and large against the
    /// errors of their vertices. Others get the general bound, depth_error.
    HWY_INLINE RuleDepth find(const TriangleVertices& v, const TrianglePlaces& p,
                              const TriangleLaterals& s, FloatVec scale, Mask fits) const {
        RuleDepth rule = {zero(), splat(kRuleDepthFactor * frame_.depth_error),
                          splat(frame_.depth_error)};
        if (frame_.axis_count != 0) narrow(rule, v, p, s, scale, fits);
        return rule;
    }

private:
    /// An upper bound of the sum of |x - X z| + |y - Y z| over a triangle's vertices, for any ray
    /// (X, Y) through the triangle.
    ///
    /// 1. The sum is convex in (X, Y), so it is largest for a ray through a vertex, from which the
    ///    other two vertices are at most an edge away: two_edges.
    /// 2. It is at most the sum for the ray in the middle plus half_extent * |z| for each vertex:
    ///    in_middle, which is less where a triangle is larger than the packet. Camera packets leave
    ///    this out: few rays are uncertain there.
    static HWY_INLINE FloatVec lateral_sum(const TriangleVertices& v, const TrianglePlaces& p,
                                           const TriangleLaterals& s) {
        FloatVec longest = zero();
        for (int k = 0; k < 3; ++k) {
            const int next = (k + 1) % 3;
            longest = max(longest, abs(s.x[k] - s.x[next]) + abs(s.y[k] - s.y[next]));
        }
        const FloatVec two_edges =
            splat(2.0f) * mul_add(p.half_extent, v.z_most - v.z_least, longest);
        if constexpr (kOnGrid) return two_edges;
        FloatVec in_middle = splat(3.0f) * (p.half_extent * v.z_size);
        for (int k = 0; k < 3; ++k) in_middle = in_middle + (abs(s.x[k]) + abs(s.y[k]));
        return min(two_edges, in_middle);
    }

    /// The range and the largest magnitude of a triangle's vertices on an axis of scene space.
    struct RuleDepths {
        FloatVec range, size;
    };

    static HWY_INLINE RuleDepths depths_along(const float row[3], const FloatVec x[3],
                                              const FloatVec y[3], const FloatVec z[3]) {
        FloatVec depth[3];
        for (int k = 0; k < 3; ++k) {
            depth[k] =
                mul_add(splat(row[0]), x[k], mul_add(splat(row[1]), y[k], splat(row[2]) * z[k]));
        }
        const FloatVec least = min3(depth[0], depth[1], depth[2]);
        const FloatVec most = max3(depth[0], depth[1], depth[2]);
        return {most - least, max(abs(least), abs(most))};
    }

    /// The largest of these over the packet's axes. A coordinate depth_rows[k] * (x, y, z) is off
    /// by kVertexRounding of its vertex's extent, put through the rows, and by kSumRounding of its
    /// terms.
    HWY_INLINE RuleDepths rule_depths(const TriangleVertices& v, const TriangleLaterals& s) const {
        RuleDepths all = depths_along(frame_.depth_rows[0], v.x, v.y, v.z);
        for (std::uint32_t axis = 1; HWY_UNLIKELY(axis < frame_.axis_count); ++axis) {
            const RuleDepths own = depths_along(frame_.depth_rows[axis], v.x, v.y, v.z);
            all = {max(all.range, own.range), max(all.size, own.size)};
        }
        constexpr float kVertexRounding = 0x1p-18f;  // 64 u; kExtentError is 24 u
        constexpr float kSumRounding = 0x1p-20f;  // 16 u; five roundings of terms, and projection
        const float projected =
            kVertexRounding * (frame_.unit * std::max(frame_.row_size[0], frame_.row_size[1]) +
                               frame_.depth_most * frame_.row_size[2]);
        const FloatVec rounded = mul_add(splat(frame_.depth_most + 2 * frame_.reach * frame_.unit),
                                         v.z_size, splat(frame_.unit) * s.size);
        const FloatVec error = mul_add(splat(projected), v.extent, splat(kSumRounding) * rounded);
        return {all.range + error, all.size + error};
    }

    /// Narrows `rule` for triangles that fit (docs/design/arithmetic.md, "Depth";
    /// proofs/packet_depth.g).
    ///
    /// 1. The rule's z of a hit, on its axis, is off by at most (2 B / S + kWeightRounding) R +
    ///    kMeanRounding Z: R is the range of the vertices' z there, Z the largest, S the sum of the
    ///    edge functions, B = r (m + 2 r) the bound of fast_edges. The rule takes the fast
    ///    functions only where this is less than the depth margin.
    /// 2. Let D be a ray's direction at z = 1, L its largest component, and s the factor of the
    ///    canonical direction, 1 <= s L < 2. A vertex is off the ray by w = (x - X z) axis_x + (y -
    ///    Y z) axis_y. The rule's x is s (w.x D.z - D.x w.z) and y alike: s L times what w measures
    ///    in its plane. So with M = across * lateral_sum (`m` in the code)
    ///        m <= s L M,   r <= 17/16 2^-21 (2 m + Z) + 2^-49 <= s L r1
    ///    where r1 (`r`) = kFastProjectionError (2 M + Z) + kFastProjectionFloor.
    /// 3. The edge functions are those of the packet under a linear map of determinant s^2 L
    ///    volume, and those of the packet add up to q / scale: S = s^2 L volume q / scale.
    /// 4. In z of the packet, an L-th of the rule's, the first term of step 1 is
    ///        2 r (m + 2 r) R / (s^2 L^2 volume q / scale) <= 2 r1 (M + 2 r1) R scale / volume / q.
    ///    With `error` = r1 (M + 2 r1) scale / volume, by_q stands for 2 error R; by_q2 has the
    ///    other terms, (kWeightRounding R + kMeanRounding Z) / L.
    /// 5. kRuleDepthError = kMeanRounding + the rounding of t + 6 u for z as the packet rounds it.
    ///    kRuleExtentError covers the errors of z that grow with `extent`.
    /// 6. by_q has 3 error R, half as much again: for `scale`, which is off by at most a quarter of
    ///    itself in triangles that fit (kKnownVolume), for other rounding, and because the rule's S
    ///    is the sum of fast functions, off by 3/64 where B <= S / 64 = kMostEdgeError S. B / S
    ///    is at most error L / q, where L / q is the depth of the hit, at most Z.
    /// 7. An error of more than kNarrowDepth z is not narrowed: a certain hit is then beyond the
    ///    rule's least depth.
    HWY_INLINE void narrow(RuleDepth& rule, const TriangleVertices& v, const TrianglePlaces& p,
                           const TriangleLaterals& s, FloatVec scale, Mask fits) const {
        constexpr float kMostEdgeError = 0x1p-6f;
        const RuleDepths depths = rule_depths(v, s);
        const FloatVec m = splat(frame_.across) * lateral_sum(v, p, s);
        const FloatVec r =
            mul_add(splat(kFastProjectionError), mul_add(splat(2.0f), m, depths.size),
                    splat(kFastProjectionFloor));
        const FloatVec error = splat(frame_.per_volume) * scale * (r * mul_add(splat(2.0f), r, m));
        const FloatVec by_q = error * (splat(3.0f) * depths.range);
        const FloatVec by_q2 = mul_add(
            splat(frame_.per_depth),
            mul_add(splat(kWeightRounding), depths.range, splat(kRuleDepthError) * depths.size),
            splat(kRuleExtentError * frame_.row_size[2]) * v.extent);
        const FloatVec in_z = mul_add(by_q, v.z_most, by_q2);
        const Mask is_thick = error * depths.size <= splat(kMostEdgeError);
        const FloatVec most = min(splat(frame_.depth_error), splat(kNarrowDepth) * v.z_least);
        const Mask is_narrower = fits & is_thick & (in_z < most);
        rule.by_q = select(is_narrower, by_q, rule.by_q);
        rule.by_q2 = select(is_narrower, by_q2, rule.by_q2);
        rule.z = select(is_narrower, in_z, rule.z);
    }

    const PacketFrame& frame_;
};

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif
