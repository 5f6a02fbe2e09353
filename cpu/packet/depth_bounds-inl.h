// 1/z of the triangles of a leaf in a packet's plane, with bounds of how far the hit rule may place
// a hit from there.

#if defined(MORPHRAY_CPU_PACKET_DEPTH_BOUNDS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_PACKET_DEPTH_BOUNDS_INL_H
#undef MORPHRAY_CPU_PACKET_DEPTH_BOUNDS_INL_H
#else
#define MORPHRAY_CPU_PACKET_DEPTH_BOUNDS_INL_H
#endif

#include <hwy/highway.h>

#include "common/interop/packet_bounds.h"
#include "cpu/packet/packet_frame.h"
#include "cpu/packet/packet_triangles-inl.h"
#include "cpu/simd/hit_rule-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {

/// 1/z of the planes through triangles, q = a x + b y + c, and its error: a hit of the rule at a
/// ray (x, y) has 1/z within c0 + q (c1 + q c2) of it, if (q + error) c2 <= kFarDepth.
struct DepthPlanes {
    FloatVec a, b, c;
    FloatVec c0, c1, c2;
    /// |a| + |b|, and the largest |q| in the triangle's part of the packet.
    FloatVec gradient, most_q;
    /// No hit is nearer than the nearest vertex by more than this in z.
    FloatVec nearer;
    /// Where q and its error are known. Elsewhere a, b and c are 0, and c0 is kUnknown.
    Mask known;

    HWY_INLINE FloatVec error_at(FloatVec q) const { return mul_add(q, mul_add(q, c2, c1), c0); }
};

/// Finds DepthPlanes for the triangles of a leaf (docs/design/arithmetic.md, "Packets", step 4;
/// lab/proofs/packet_slant.g).
class DepthBounds {
public:
    /// distance: the largest coordinate of the leaf's first vertex relative to the origin.
    HWY_INLINE DepthBounds(const PacketFrame& frame, float distance)
        : frame_(frame),
          shear_(kShearError * frame.reach),
          shift_by_extent_(frame.per_depth * (2 * kWeightRounding + kRuleDepthError) +
                           kDepthError * frame.row_size[2]),
          shift_(frame.per_depth *
                     (kRuleDepthError * distance + kFastDepthOfMargin * frame.depth_margin) +
                 kDepthError * frame.row_size[2] * distance),
          slant_(kSlantDistance * distance + kGridError),
          vertex_(kDistanceError * distance + kGridError) {}

    /// usable: where the volume is large enough for 1/z to be known.
    ///
    /// 1. q = n.(x, y, 1) / det is 1/z of the plane through the projected vertices. A hit of the
    ///    rule has weights; the mean of the projected vertices under these is a point of that
    ///    plane, off the ray by their errors. With N the normal of the plane in scene space, for
    ///    which N.p = 1, an error of e in scene space changes 1/z by N.e of itself, and one of (ex,
    ///    ey, ez) in the projection by a ex + b ey + c ez.
    /// 2. The projection of a vertex is off by kVertexError of `extent` in each of its rows, and by
    ///    kLateralError and kShearError of its distance from the ray. kPlaneError is that of
    ///    rounded differences and of det.
    /// 3. The rule's weights are those of points that are displaced across the ray, by the exact
    ///    path 3 u of their distance from it, by the fast path 3 u of that and 4 u of z:
    ///    kSlantExtent and kSlantDistance.
    /// 4. What the fast path rounds in its edge functions moves its hit along the ray. It is a 51st
    ///    of the bound that surely_inside compares with a quarter of the depth margin:
    ///    kFastDepthOfMargin.
    /// 5. The rule's mean of depths and t add kWeightRounding of their range, at most 2 extent, and
    ///    kRuleDepthError of their size, at most distance + extent.
    /// 6. Steps 2 and 3 are `slope`, relative to q, steps 4 and 5 `shift`, in z. A plane with a
    ///    slope of more than kMostSlope is not known.
    /// 7. q rounds by kGradientRounding gradient + kReciprocalRounding q, and a ray that is
    ///    ray_error off its place adds ray_error gradient.
    HWY_INLINE DepthPlanes find(const TriangleVertices& v, const TrianglePlaces& p,
                                const TriangleLaterals& s, const TrianglePlaneSet& planes,
                                FloatVec sign, Mask usable) const {
        const FloatVec scale = splat(1.0f) / max(abs(planes.det), splat(kLeastVolume));
        const FloatVec signed_scale = zero_unless(usable, scale | sign);
        const FloatVec a = planes.normal[0] * signed_scale;
        const FloatVec b = planes.normal[1] * signed_scale;
        const FloatVec in_middle = planes.normal[2] * signed_scale;
        const FloatVec c = neg_mul_add(a, p.middle_x, neg_mul_add(b, p.middle_y, in_middle));
        Sizes sizes = sizes_of(a, b, c);
        FloatVec c0 = zero();
#if HWY_NATIVE_FMA
        const FloatVec slope = slope_of(v, s, sizes);
#else
        const FloatVec unfused = add_unfused(v, p, s, zero_unless(usable, scale), sizes, c0);
        const FloatVec slope = slope_of(v, s, sizes) + unfused;
#endif
        DepthPlanes out;
        out.known = usable & (slope <= splat(kMostSlope));
        out.a = zero_unless(out.known, a);
        out.b = zero_unless(out.known, b);
        out.c = zero_unless(out.known, c);
        c0 = mul_add(splat(kGradientRounding + kRayDepthError * frame_.ray_error), sizes.gradient,
                     c0);
        out.c0 = select(out.known, c0, splat(kUnknown));
        out.c1 = zero_unless(out.known, slope + splat(kReciprocalRounding));
        const FloatVec shift = mul_add(splat(shift_by_extent_), v.extent, splat(shift_));
        out.c2 = splat(kRuleDepthFactor) * shift;
        out.nearer = mul_add(splat(frame_.row_size[2] * kSlantExtent), v.extent,
                             shift + splat(frame_.row_size[2] * slant_));
        out.gradient = sizes.gradient;
        out.most_q = mul_add(sizes.gradient, p.half_extent, abs(in_middle));
        return out;
    }

private:
    /// Magnitudes of the plane q = a x + b y + c.
    struct Sizes {
        /// |a| + |b|, and the sum over the projection's rows of a coefficient times the row's size.
        FloatVec gradient, rows;
        /// A bound of the sum of |N|'s components.
        FloatVec normal;
    };

    /// c is off by less than 2^-14 gradient (kGradientRounding): kShareOfDepth in `rows`, of which
    /// kRestOfNormal goes to `normal`.
    HWY_INLINE Sizes sizes_of(FloatVec a, FloatVec b, FloatVec c) const {
        constexpr float kShareOfDepth = 0x1p-7f;
        constexpr float kRestOfNormal = 0x1p-6f;
        const float* size = frame_.row_size;
        const FloatVec size_a = abs(a);
        const FloatVec size_b = abs(b);
        Sizes sizes;
        sizes.gradient = size_a + size_b;
        sizes.rows = mul_add(
            splat(size[0] + kShareOfDepth * size[2]), size_a,
            mul_add(splat(size[1] + kShareOfDepth * size[2]), size_b, splat(size[2]) * abs(c)));
        sizes.normal = splat(kRestOfNormal) * sizes.rows;
        for (int axis = 0; axis < 3; ++axis) {
            const FloatVec n = mul_add(
                splat(frame_.rows_f[0][axis]), a,
                mul_add(splat(frame_.rows_f[1][axis]), b, splat(frame_.rows_f[2][axis]) * c));
            sizes.normal = sizes.normal + abs(n);
        }
        return sizes;
    }

    /// Step 6: `slope`, for what kSteepError pays the second order.
    HWY_INLINE FloatVec slope_of(const TriangleVertices& v, const TriangleLaterals& s,
                                 const Sizes& sizes) const {
        const FloatVec lateral = mul_add(splat(kPlaneError + kLateralError), s.size,
                                         mul_add(splat(shear_), v.z_size, splat(kPlaneFloor)));
        const FloatVec vertex = mul_add(splat(kVertexError), v.extent, splat(vertex_));
        const FloatVec slant = mul_add(splat(kSlantExtent), v.extent, splat(slant_));
        return splat(kSteepError) *
               mul_add(lateral, sizes.gradient, mul_add(vertex, sizes.rows, slant * sizes.normal));
    }

    /// Without fused operations the normal's components are off by kUnfusedDepth of their products,
    /// of a and b by z_size, of 1/z in the middle by `size`. Returns what that is of det.
    HWY_INLINE FloatVec add_unfused(const TriangleVertices& v, const TrianglePlaces& p,
                                    const TriangleLaterals& s, FloatVec scale, Sizes& sizes,
                                    FloatVec& c0) const {
        const float* size = frame_.row_size;
        const FloatVec by_depth = splat(kUnfusedDepth) * (s.size * scale);
        const FloatVec of_gradient = by_depth * v.z_size;
        const FloatVec of_middle = by_depth * s.size;
        const FloatVec of_rows = mul_add(splat(size[0] + size[1] + 2 * frame_.reach * size[2]),
                                         of_gradient, splat(size[2]) * of_middle);
        c0 = mul_add(of_gradient, p.half_extent, of_middle);
        sizes.gradient = mul_add(splat(2.0f), of_gradient, sizes.gradient);
        sizes.rows = sizes.rows + of_rows;
        sizes.normal = sizes.normal + of_rows;
        return of_middle * v.z_size;
    }

    const PacketFrame& frame_;
    float shear_;
    float shift_by_extent_, shift_;
    float slant_, vertex_;
};

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif
