// How far the hit rule may place a hit from the plane of its triangle.

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
#include "cpu/packet/packet.h"
#include "cpu/simd/fast_hit_rule-inl.h"

HWY_BEFORE_NAMESPACE();
namespace morphray::cpu {
namespace HWY_NAMESPACE {

/// How far the rule may place a hit from the plane of the triangle: by_q * q + by_q2 * q^2 in
/// q = 1/z, at most `z` in z.
struct RuleDepth {
    FloatVec by_q, by_q2, z;
};

/// Triangles in a packet's projection: their vertices as they are (x, y, z) and with the middle of
/// their rectangle in the middle (px, py), and what TriangleSetup finds of them.
struct ProjectedTriangles {
    const FloatVec *x, *y, *z;
    const FloatVec *px, *py;
    FloatVec z_least, z_most, z_size, size, extent, half_extent, scale;
};

/// Bounds RuleDepth. kOnGrid: the packet is a camera's.
template <bool kOnGrid>
class DepthBounds {
public:
    explicit DepthBounds(const PacketFrame& frame) : frame_(frame) {}

    /// fit: the triangles in front of the eye that the errors of their vertices are small against.
    HWY_INLINE RuleDepth find(const ProjectedTriangles& t, Mask fit) const {
        RuleDepth rule = {zero(), splat(kRuleDepthFactor * frame_.depth_error),
                          splat(frame_.depth_error)};
        if (frame_.axis_count != 0) narrow(rule, t, fit);
        return rule;
    }

private:
    /// A bound of the sum of |x - X z| + |y - Y z| over a triangle's vertices for each ray (X, Y)
    /// that goes through it. It is no more than for a ray through a vertex, since it is convex in
    /// (X, Y), and the other vertices are at most an edge away from that. Nor is it more than what
    /// the ray in the middle sees and half_extent times the sum of |z|, which is less where a
    /// triangle is larger than the packet; a camera's have few doubts there.
    static HWY_INLINE FloatVec lateral_sum(const ProjectedTriangles& t) {
        FloatVec longest = zero();
        for (int k = 0; k < 3; ++k) {
            const int next = (k + 1) % 3;
            longest = max(longest, abs(t.px[k] - t.px[next]) + abs(t.py[k] - t.py[next]));
        }
        const FloatVec two_edges =
            splat(2.0f) * mul_add(t.half_extent, t.z_most - t.z_least, longest);
        if constexpr (kOnGrid) return two_edges;
        FloatVec in_middle = splat(3.0f) * (t.half_extent * t.z_size);
        for (int k = 0; k < 3; ++k) in_middle = in_middle + (abs(t.px[k]) + abs(t.py[k]));
        return min(two_edges, in_middle);
    }

    /// Of a triangle's vertices on a packet's axis where it is largest: their range, and the
    /// largest magnitude. In scene space.
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
        const FloatVec least = min(depth[0], min(depth[1], depth[2]));
        const FloatVec most = max(depth[0], max(depth[1], depth[2]));
        return {most - least, max(abs(least), abs(most))};
    }

    /// Each coordinate is off by some roundings of its parts, and by those of the projected
    /// vertices.
    HWY_INLINE RuleDepths rule_depths(const ProjectedTriangles& t) const {
        RuleDepths all = depths_along(frame_.depth_rows[0], t.x, t.y, t.z);
        for (std::uint32_t axis = 1; HWY_UNLIKELY(axis < frame_.axis_count); ++axis) {
            const RuleDepths own = depths_along(frame_.depth_rows[axis], t.x, t.y, t.z);
            all = {max(all.range, own.range), max(all.size, own.size)};
        }
        const float projected =
            0x1p-18f * (frame_.unit * std::max(frame_.row_size[0], frame_.row_size[1]) +
                        frame_.depth_most * frame_.row_size[2]);
        const FloatVec rounded = mul_add(splat(frame_.depth_most + 2 * frame_.reach * frame_.unit),
                                         t.z_size, splat(frame_.unit) * t.size);
        const FloatVec error = mul_add(splat(projected), t.extent, splat(0x1p-20f) * rounded);
        return {all.range + error, all.size + error};
    }

    /// The rule's z, of a hit and on its axis, is off by at most (2 B / S + kWeightRounding) R +
    /// kMeanRounding Z (docs/design/arithmetic.md, "Depth"), and the plain edge functions are taken
    /// only where that is less than the dilation of boxes; R is the range of the vertices' z, Z the
    /// largest, S the sum of the edge functions, B = r (m + 2 r) the bound of fast_edges. The rest
    /// puts these into the packet's terms. Let D be the ray's direction at z = 1, L its largest
    /// component, and s the factor of the canonical direction, so that 1 <= s L < 2. A vertex lies
    /// off the ray by w = (x - X z) axis_x + (y - Y z) axis_y. The rule's x is s (w.x D.z - D.x
    /// w.z), y alike, that is s L times what w measures in its plane, at most `across` times what
    /// `lateral` sums up. So with M = across * lateral
    ///     m <= s L M,   r <= 17/16 2^-21 (2 m + Z) + 2^-49 <= s L r1,
    ///     r1 = 17/16 2^-21 (2 M + Z) + 2^-49.
    /// The edge functions are those of the packet under a linear map of determinant s^2 L volume,
    /// and those add up to q / scale, so S = s^2 L volume q / scale. In z of the packet, a L-th of
    /// the rule's, the error is at most
    ///     2 r (m + 2 r) R / (s^2 L^2 volume q / scale) + (kWeightRounding R + kMeanRounding Z) / L
    ///     <= 2 r1 (M + 2 r1) R scale / volume / q + (kWeightRounding R + kMeanRounding Z) / L.
    /// kRuleDepthError has kMeanRounding, the rounding of t, and 6 u for what the packet rounds z
    /// itself. Half as much again is left for `scale`, which of triangles that fit is a quarter of
    /// itself off at most (kKnownVolume), for other rounding, and because the rule's S is the sum
    /// of plain functions: where B <= S / 64 that is 3 / 64 away (proofs/packet_depth.g). Other
    /// triangles are not narrowed, nor errors of more than a sixteenth of z: then a sure hit is one
    /// beyond the rule's least depth. B / S is at most r1 (M + 2 r1) scale / volume times L / q,
    /// the depth of the hit. Then there are the packet's own errors of the vertices' z that grow
    /// with `extent`.
    HWY_INLINE void narrow(RuleDepth& rule, const ProjectedTriangles& t, Mask fit) const {
        const RuleDepths depths = rule_depths(t);
        const FloatVec m = splat(frame_.across) * lateral_sum(t);
        const FloatVec r =
            mul_add(splat(kFastProjectionError), mul_add(splat(2.0f), m, depths.size),
                    splat(kFastProjectionFloor));
        const FloatVec error =
            splat(frame_.per_volume) * t.scale * (r * mul_add(splat(2.0f), r, m));
        const FloatVec by_q = error * (splat(3.0f) * depths.range);
        const FloatVec by_q2 = mul_add(
            splat(frame_.per_depth),
            mul_add(splat(kWeightRounding), depths.range, splat(kRuleDepthError) * depths.size),
            splat(kRuleExtentError * frame_.row_size[2]) * t.extent);
        const FloatVec in_z = mul_add(by_q, t.z_most, by_q2);
        const Mask thick = error * depths.size <= splat(0x1p-6f);
        const FloatVec most = min(splat(frame_.depth_error), splat(kNarrowDepth) * t.z_least);
        const Mask better = fit & thick & (in_z < most);
        rule.by_q = select(better, by_q, rule.by_q);
        rule.by_q2 = select(better, by_q2, rule.by_q2);
        rule.z = select(better, in_z, rule.z);
    }

    const PacketFrame& frame_;
};

}  // namespace HWY_NAMESPACE
}  // namespace morphray::cpu
HWY_AFTER_NAMESPACE();

#endif
