// Setting up the triangles of a leaf in the plane of a packet, with bounds of every error.

#if defined(MORPHRAY_PACKET_SETUP_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_PACKET_SETUP_INL_H
#undef MORPHRAY_PACKET_SETUP_INL_H
#else
#define MORPHRAY_PACKET_SETUP_INL_H
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cstdint>

#include "common/interop/layout.h"
#include "cpu/packet.h"
#include "cpu/packet_blocks-inl.h"
#include "cpu/packet_vertices-inl.h"
#include "cpu/rule_vectors-inl.h"

HWY_BEFORE_NAMESPACE();
namespace morphray::cpu {
namespace HWY_NAMESPACE {

/// Sixteen triangles of a leaf, set up: edge functions a x + b y + c of the packet's plane,
/// positive inside; their bound; and 1/z = depth_a x + depth_b y + depth_c, of which q is too small
/// or too large by at most c0 + q (c1 + q c2), for a camera's rays by at most `error`.
struct alignas(64) Setup {
    float a[3][16], b[3][16], c[3][16];
    float depth_a[16], depth_b[16], depth_c[16];
    float bound[16], error[16], c0[16], c1[16], c2[16], q[16];
    Rectangles rectangles;
    GridWindows windows;
    /// Of a point's: c plus the bound, and depth_c plus the largest error (LeafOcclusion).
    float most_c[3][16], most_q[16];
};

/// kOnGrid: the packet is a camera's, whose rays are near the middles of pixels.
template <bool kOnGrid>
class TriangleSetup {
public:
    explicit TriangleSetup(const PacketFrame& frame) : frame_(frame) {}

    /// The triangles of the leaf that may concern a ray of the packet, as bits.
    std::uint32_t run(const Leaf& leaf, Setup& setup) const {
        bool all_finite = true;
        std::uint32_t alive = set_up(leaf, setup, all_finite);
        alive &= (1u << corner_triangle_count(leaf.vertex[0].corners)) - 1;
        if (HWY_UNLIKELY(!all_finite)) alive &= finite_triangles(leaf);
        return alive;
    }

private:
    /// Sets up all triangles of a leaf; which of them may cover a ray of the packet.
    ///
    /// Vertices: v0, the leaf's first, is projected in double; the others by rows * (v - v0), off
    /// by at most 5 * 2^-24 row_size extent from the product and 4 * 2^-24 of the result from the
    /// sums; `extent` is the largest coordinate of a triangle's v - v0. The rule displaces a vertex
    /// by 2^-22 of its distance from the ray, for a ray through the triangle at most 8 * 2^-24
    /// row_size extent: leaf_error has 16 for both. In x - X z and y - Y z, where |X| and |Y| are
    /// frame.reach at most and |x| that times z and |x - X z| more, the sums make 4, and 4 again by
    /// z, and the difference 1 in units of 2^-24 reach z, for which `error` has 16. Edge functions
    /// are taken in the middle (X0, Y0) of the triangle's rectangle inside the packet; no ray of a
    /// block that meets the rectangle is farther from there than half its extent and a block, so
    /// `reach` bounds |x - X z| + |y - Y z| of all vertices for all of them. Two vertices off by
    /// error each move an edge function by at most 4 error reach (twice the first-order term), and
    /// its own rounding, with that of a X0 + b Y0, by at most 2^-21 reach (reach + 4 frame.reach
    /// z). A ray that is off by ray_error moves it by the sum of |a| and |b| times that.
    HWY_INLINE std::uint32_t set_up(const Leaf& leaf, Setup& setup, bool& all_finite) const {
        const Floats f;
        alignas(64) float vx[16], vy[16], vz[16], sizes[16];
        alignas(64) std::uint32_t corners[16];
        all_finite = project_vertices(frame_, leaf, vx, vy, vz, sizes, corners);
        std::uint32_t alive = 0;
        for (std::size_t l = 0; l < kLeafTriangles; l += hn::Lanes(f)) {
            VF x[3], y[3], z[3], size[3];
            const VW packed = hn::Load(Words(), corners + l);
            gather_corners(vx, packed, x);
            gather_corners(vy, packed, y);
            gather_corners(vz, packed, z);
            gather_corners(sizes, packed, size);
            const VF extent = hn::Max(size[0], hn::Max(size[1], size[2]));
            alive |= mask_bits(set_up_triangles(x, y, z, extent, setup, l)) << l;
        }
        return alive;
    }

    HWY_INLINE Mask set_up_triangles(const VF x[3], const VF y[3], const VF z[3], VF extent,
                                     Setup& setup, std::size_t l) const {
        const Floats f;
        const float row_sizes =
            frame_.row_size[0] + frame_.row_size[1] + 2 * frame_.reach * frame_.row_size[2];
        const VF leaf_error = hn::Mul(splat(0x1p-20f * row_sizes), extent);
        const VF zero = hn::Zero(f);
        const VF half = splat(0.5f);
        const VF z_least = hn::Min(z[0], hn::Min(z[1], z[2]));
        const VF z_most = hn::Max(z[0], hn::Max(z[1], z[2]));
        const VF z_size = hn::Max(hn::Abs(z_least), hn::Abs(z_most));
        const VF z_error = hn::MulAdd(splat(0x1p-22f), z_size, leaf_error);

        // The rectangle, where the triangle is well in front of the eye.
        const VF least = splat(1e-10f);
        const VF near = hn::MulAdd(splat(0x1p-10f), z_size, hn::Mul(splat(16.0f), leaf_error));
        const Mask in_front = hn::Gt(z_least, hn::Max(near, least));
        VF rx[3], ry[3];
        VF largest = zero;
        for (int k = 0; k < 3; ++k) {
            const VF rz = hn::Div(splat(1.0f), hn::Max(z[k], least));
            largest = hn::Max(largest, rz);
            rx[k] = hn::Mul(x[k], rz);
            ry[k] = hn::Mul(y[k], rz);
        }
        const VF margin = hn::MulAdd(hn::Mul(splat(2.01f), leaf_error), largest,
                                     splat(2 * frame_.ray_error + 0x1p-16f));
        const VF all = splat(1e6f);
        // Besides the margin: 2^-20 of the value for the rounding of division and sums.
        const auto lower = [&](const VF r[3]) {
            const VF v = hn::Min(r[0], hn::Min(r[1], r[2]));
            return hn::IfThenElse(in_front,
                                  hn::Sub(hn::NegMulAdd(splat(0x1p-20f), hn::Abs(v), v), margin),
                                  hn::Neg(all));
        };
        const auto upper = [&](const VF r[3]) {
            const VF v = hn::Max(r[0], hn::Max(r[1], r[2]));
            return hn::IfThenElse(in_front,
                                  hn::Add(hn::MulAdd(splat(0x1p-20f), hn::Abs(v), v), margin), all);
        };
        const VF lower_x = lower(rx);
        const VF upper_x = upper(rx);
        const VF lower_y = lower(ry);
        const VF upper_y = upper(ry);
        const VF cut_lower_x = hn::Max(lower_x, splat(frame_.lower_x));
        const VF cut_upper_x = hn::Min(upper_x, splat(frame_.upper_x));
        const VF cut_lower_y = hn::Max(lower_y, splat(frame_.lower_y));
        const VF cut_upper_y = hn::Min(upper_y, splat(frame_.upper_y));
        Mask meets = hn::Gt(hn::Add(z_most, z_error), zero);
        if constexpr (kOnGrid) {
            // Most small triangles cover no pixel's middle at all.
            const PixelRange pixels_x(lower_x, upper_x, 0, frame_.grid_columns);
            const PixelRange pixels_y(lower_y, upper_y, 0, frame_.grid_rows);
            setup.windows.set(l, pixels_x, pixels_y);
            meets = hn::And(meets, hn::And(pixels_x.any(), pixels_y.any()));
        } else {
            hn::Store(lower_x, f, setup.rectangles.lower_x + l);
            hn::Store(upper_x, f, setup.rectangles.upper_x + l);
            hn::Store(lower_y, f, setup.rectangles.lower_y + l);
            hn::Store(upper_y, f, setup.rectangles.upper_y + l);
            meets = hn::And(
                meets, hn::And(hn::Le(cut_lower_x, cut_upper_x), hn::Le(cut_lower_y, cut_upper_y)));
        }

        const VF middle_x = hn::Mul(half, hn::Add(cut_lower_x, cut_upper_x));
        const VF middle_y = hn::Mul(half, hn::Add(cut_lower_y, cut_upper_y));
        VF px[3], py[3];
        VF size = zero;
        for (int k = 0; k < 3; ++k) {
            px[k] = hn::NegMulAdd(middle_x, z[k], x[k]);
            py[k] = hn::NegMulAdd(middle_y, z[k], y[k]);
            size = hn::Max(size, hn::Add(hn::Abs(px[k]), hn::Abs(py[k])));
        }
        const VF half_extent = hn::Mul(
            half, hn::Add(hn::Sub(cut_upper_x, cut_lower_x), hn::Sub(cut_upper_y, cut_lower_y)));
        const VF reach = hn::MulAdd(hn::Add(half_extent, splat(frame_.block_extent)), z_size, size);
        const VF error = hn::MulAdd(splat(0x1p-21f), reach,
                                    hn::MulAdd(splat(0x1p-20f * frame_.reach), z_size, leaf_error));
        const VF rounding = hn::Mul(
            splat(0x1p-21f), hn::Mul(reach, hn::MulAdd(splat(4 * frame_.reach), z_size, reach)));

        VF a[3], b[3], c[3];
        const auto edge = [&](int k, int i, int j) {
            a[k] = hn::MulSub(py[i], z[j], hn::Mul(z[i], py[j]));
            b[k] = hn::MulSub(z[i], px[j], hn::Mul(px[i], z[j]));
            c[k] = hn::MulSub(px[i], py[j], hn::Mul(py[i], px[j]));
        };
        edge(0, 1, 2);
        edge(1, 2, 0);
        edge(2, 0, 1);
        VF slope = zero;
        for (int k = 0; k < 3; ++k) slope = hn::Max(slope, hn::Add(hn::Abs(a[k]), hn::Abs(b[k])));
        const VF ray_error = splat(1.01f * frame_.ray_error);
        VF bound =
            hn::MulAdd(ray_error, slope,
                       hn::MulAdd(hn::Mul(splat(4.0f), error), hn::Add(reach, error), rounding));
        VF det = hn::MulAdd(px[0], a[0], hn::MulAdd(py[0], b[0], hn::Mul(z[0], c[0])));
        const VF sign = hn::And(det, splat(-0.0f));
        const VF scale = hn::Div(splat(1.0f), hn::Max(hn::Abs(det), splat(1e-30f)));
        // What overflows (eyes and vertices very far away) leaves everything in doubt. All else
        // follows from the two, since reach bounds the vertices and 2^-21 reach^2 is a part of the
        // bound.
        const Mask sane = hn::And(hn::Lt(bound, splat(1e28f)), hn::Lt(hn::Abs(det), splat(1e34f)));
        VF signed_scale = hn::Or(scale, sign);
        if (HWY_UNLIKELY(!hn::AllTrue(f, sane))) {
            signed_scale = hn::IfThenElseZero(sane, signed_scale);
            bound = hn::IfThenElse(sane, bound, splat(1e35f));
            det = hn::IfThenElseZero(sane, det);
            for (int k = 0; k < 3; ++k) {
                a[k] = hn::IfThenElseZero(sane, a[k]);
                b[k] = hn::IfThenElseZero(sane, b[k]);
                c[k] = hn::IfThenElseZero(sane, c[k]);
            }
        }
        const VF depth_a = hn::Mul(hn::Add(hn::Add(a[0], a[1]), a[2]), signed_scale);
        const VF depth_b = hn::Mul(hn::Add(hn::Add(b[0], b[1]), b[2]), signed_scale);
        const VF in_middle = hn::Mul(hn::Add(hn::Add(c[0], c[1]), c[2]), signed_scale);
        hn::Store(bound, f, setup.bound + l);
        for (int k = 0; k < 3; ++k) {
            const VF ak = hn::Xor(a[k], sign);
            const VF bk = hn::Xor(b[k], sign);
            const VF ck = hn::Xor(c[k], sign);
            hn::Store(ak, f, setup.a[k] + l);
            hn::Store(bk, f, setup.b[k] + l);
            hn::Store(hn::NegMulAdd(ak, middle_x, hn::NegMulAdd(bk, middle_y, ck)), f,
                      setup.c[k] + l);
        }
        // 1/z is that of the plane through the projected vertices; displacing them by `error` moves
        // it by its gradient times that, while the displacement is small against the triangle.
        // Where it is not, nothing is certain. Then there are roundings: relative ones of det; of
        // the sums of a and b, which count as far as the rectangle reaches, and of c; and those of
        // moving the plane's origin.
        const VF gradient = hn::Add(hn::Abs(depth_a), hn::Abs(depth_b));
        const VF steep = hn::Mul(hn::Mul(splat(8.0f), error), gradient);
        const VF relative_size = hn::Mul(splat(0x1p-20f), hn::Mul(size, scale));
        const VF det_error = hn::Mul(relative_size, hn::Mul(size, z_size));
        const VF sum_error = hn::Mul(relative_size, hn::MulAdd(z_size, half_extent, size));
        const VF displacement = hn::Mul(splat(16.0f), hn::Mul(error, hn::Mul(size, z_size)));
        const Mask uncertain = hn::Ge(displacement, hn::Abs(det));
        RuleDepth rule = {hn::Zero(f), splat(frame_.depth_error), splat(frame_.depth_error)};
        if (frame_.axis_count != 0) {
            const VF lateral = lateral_sum(px, py, half_extent, hn::Sub(z_most, z_least));
            const VF range = depth_range(x, y, z, size, z_size, extent);
            // Displacing the vertices moves det by 12 error size z_size: here by less than a fifth.
            const Mask sharp = hn::Lt(hn::Mul(splat(4.0f), displacement), hn::Abs(det));
            narrow(rule, hn::And(in_front, sharp), lateral, range, scale, z_least, z_most);
        }
        const VF c0 = hn::MulAdd(splat(0x1p-15f + 1.01f * frame_.ray_error), gradient, sum_error);
        const VF c1 = hn::Add(hn::Add(splat(0x1p-19f), rule.by_q), hn::Add(steep, det_error));
        const auto known = [uncertain](VF value)
                               HWY_ATTR { return hn::IfThenZeroElse(uncertain, value); };
        const VF depth_c =
            hn::NegMulAdd(depth_a, middle_x, hn::NegMulAdd(depth_b, middle_y, in_middle));
        hn::Store(known(depth_a), f, setup.depth_a + l);
        hn::Store(known(depth_b), f, setup.depth_b + l);
        hn::Store(known(depth_c), f, setup.depth_c + l);
        const VF nearest = nearest_q(hn::Sub(hn::Sub(z_least, z_error), rule.z));
        hn::Store(nearest, f, setup.q + l);
        if constexpr (kOnGrid) {
            // A ray that the rule may find to hit the triangle lies in its rectangle.
            const VF most_q = hn::MulAdd(gradient, half_extent, hn::Abs(in_middle));
            const VF most = hn::MulAdd(most_q, hn::MulAdd(most_q, rule.by_q2, c1), c0);
            hn::Store(hn::IfThenElse(uncertain, splat(1e35f), hn::Mul(most, splat(1.0001f))), f,
                      setup.error + l);
        } else {
            const VF sure_c0 = hn::IfThenElse(uncertain, splat(1e35f), c0);
            const VF sure_c1 = known(c1);
            hn::Store(sure_c0, f, setup.c0 + l);
            hn::Store(sure_c1, f, setup.c1 + l);
            hn::Store(rule.by_q2, f, setup.c2 + l);
            const VF most_bound = hn::Mul(splat(1.25f), bound);
            for (int k = 0; k < 3; ++k)
                hn::Store(hn::Add(hn::Load(f, setup.c[k] + l), most_bound), f, setup.most_c[k] + l);
            const VF most = hn::MulAdd(nearest, hn::MulAdd(nearest, rule.by_q2, sure_c1), sure_c0);
            const VF rounded =
                hn::MulAdd(splat(0x1p-16f), gradient, hn::Mul(splat(1 + 0x1p-18f), most));
            hn::Store(hn::Add(hn::Load(f, setup.depth_c + l), rounded), f, setup.most_q + l);
        }
        return meets;
    }

    /// How far the rule may place a hit from the plane of the triangle: by_q * q + by_q2 * q^2 in
    /// q = 1/z, at most `z` in z.
    struct RuleDepth {
        VF by_q, by_q2, z;
    };

    /// A bound of the sum of |x - X z| + |y - Y z| over a triangle's vertices for each ray (X, Y)
    /// that goes through it. The sum is convex in (X, Y), so it is largest for a ray through a
    /// vertex, which the other two are at most an edge away from. px, py: the vertices for a ray no
    /// farther than half_extent from (X, Y).
    static HWY_INLINE VF lateral_sum(const VF px[3], const VF py[3], VF half_extent, VF z_range) {
        VF longest = hn::Zero(Floats());
        for (int k = 0; k < 3; ++k) {
            const int next = (k + 1) % 3;
            longest = hn::Max(longest, hn::Add(hn::Abs(hn::Sub(px[k], px[next])),
                                               hn::Abs(hn::Sub(py[k], py[next]))));
        }
        return hn::Mul(splat(2.0f), hn::MulAdd(half_extent, z_range, longest));
    }

    static HWY_INLINE VF range_along(const float row[3], const VF x[3], const VF y[3],
                                     const VF z[3]) {
        VF depth[3];
        for (int k = 0; k < 3; ++k) {
            depth[k] = hn::MulAdd(splat(row[0]), x[k],
                                  hn::MulAdd(splat(row[1]), y[k], hn::Mul(splat(row[2]), z[k])));
        }
        return hn::Sub(hn::Max(depth[0], hn::Max(depth[1], depth[2])),
                       hn::Min(depth[0], hn::Min(depth[1], depth[2])));
    }

    /// The range of the vertices' coordinates on that of the packet's axes where it is largest, in
    /// scene space. Each is off by some roundings of its parts, and by those of the projected
    /// vertices.
    HWY_INLINE VF depth_range(const VF x[3], const VF y[3], const VF z[3], VF size, VF z_size,
                              VF extent) const {
        VF range = range_along(frame_.depth_rows[0], x, y, z);
        for (std::uint32_t axis = 1; HWY_UNLIKELY(axis < frame_.axis_count); ++axis)
            range = hn::Max(range, range_along(frame_.depth_rows[axis], x, y, z));
        const float projected =
            0x1p-18f * (frame_.unit * std::max(frame_.row_size[0], frame_.row_size[1]) +
                        frame_.depth_most * frame_.row_size[2]);
        const VF rounded = hn::MulAdd(splat(frame_.depth_most + 2 * frame_.reach * frame_.unit),
                                      z_size, hn::Mul(splat(frame_.unit), size));
        return hn::MulAdd(splat(projected), extent, hn::MulAdd(splat(0x1p-20f), rounded, range));
    }

    /// The rule's z, of a hit and on its axis, is off by at most 2 B R / S + 2^-20 Z
    /// (docs/arithmetic.md, "Depth"), and the plain edge functions are taken only where that is
    /// less than the dilation of boxes; R is the range of the vertices' z, S the sum of the edge
    /// functions, B = r (m + 2 r) the bound of fast_edges. The rest puts these into the packet's
    /// terms. Let D be the ray's direction at z = 1, L its largest component, and s the factor of
    /// the canonical direction, so that 1 <= s L < 2. A vertex lies off the ray by w = (x - X z)
    /// axis_x + (y - Y z) axis_y, so |w|_1 is at most `unit` times what `lateral` sums up. The
    /// rule's |x| + |y| are at most s L (|w|_1 + |w.z|) <= 2 s L |w|_1. So with M = unit * lateral
    ///     m <= 2 s L M,   Z <= L z_size + M,   r <= 17/16 2^-21 (8 M + Z) + 2^-49.
    /// The edge functions are those of the packet under a linear map of determinant s^2 L volume,
    /// and those add up to q / scale, so S = s^2 L volume q / scale. In z of the packet, a L-th of
    /// the rule's, the error is at most
    ///     2 r (2 s L M + 2 r) R / (s^2 L^2 volume q / scale) + 2^-20 Z / L
    ///     <= 4 r (M + r) R scale / volume / q + 2^-20 Z / L.
    /// A quarter is left for rounding, for that of `scale`, and because the rule's S is the sum of
    /// plain functions: where B <= S / 64 that is 3/64 away. Other triangles are not narrowed, nor
    /// errors of more than a quarter of z: then a sure hit is one beyond the rule's least depth.
    /// With 1 / s <= L, B / S is at most 2 r (M + r) scale L / volume / q.
    HWY_INLINE void narrow(RuleDepth& rule, Mask sharp, VF lateral, VF range, VF scale, VF z_least,
                           VF z_most) const {
        const VF m = hn::Mul(splat(frame_.unit), lateral);
        const VF depth = hn::MulAdd(splat(frame_.depth_most), z_most, m);
        const VF r = hn::MulAdd(splat(kFastProjectionError), hn::MulAdd(splat(8.0f), m, depth),
                                splat(kFastProjectionFloor));
        const VF error =
            hn::Mul(hn::Mul(splat(frame_.per_volume), scale), hn::Mul(r, hn::Add(m, r)));
        const VF by_q = hn::Mul(error, hn::Mul(splat(5.0f), range));
        const VF by_q2 = hn::Mul(splat(0x1p-20f * 1.25f * frame_.per_depth), depth);
        const VF in_z = hn::MulAdd(by_q, z_most, by_q2);
        const Mask thick = hn::Le(hn::Mul(error, depth), splat(0x1p-7f));
        const VF most = hn::Min(splat(frame_.depth_error), hn::Mul(splat(0.25f), z_least));
        const Mask better = hn::And(hn::And(sharp, thick), hn::Lt(in_z, most));
        rule.by_q = hn::IfThenElse(better, by_q, rule.by_q);
        rule.by_q2 = hn::IfThenElse(better, by_q2, rule.by_q2);
        rule.z = hn::IfThenElse(better, in_z, rule.z);
    }

    const PacketFrame& frame_;
};

}  // namespace HWY_NAMESPACE
}  // namespace morphray::cpu
HWY_AFTER_NAMESPACE();

#endif
