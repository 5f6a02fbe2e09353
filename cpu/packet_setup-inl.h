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
#include "cpu/packet_depth-inl.h"
#include "cpu/packet_vertices-inl.h"
#include "cpu/rule_vectors-inl.h"

HWY_BEFORE_NAMESPACE();
namespace morphray::cpu {
namespace HWY_NAMESPACE {

/// Sixteen triangles of a leaf, set up: edge functions a x + b y + c of the packet's plane,
/// positive inside; their bound; and 1/z = depth_a x + depth_b y + depth_c, of which q is too small
/// or too large by at most c0 + q (c1 + q c2), for a camera's rays by at most `error`. Those that a
/// camera sees have `error` and windows; others c0, c1, c2, nearest_q, rectangles and the last two.
struct alignas(64) Setup {
    float a[3][16], b[3][16], c[3][16];
    float depth_a[16], depth_b[16], depth_c[16];
    float bound[16], error[16], c0[16], c1[16], c2[16], q[16];
    Rectangles rectangles;
    GridWindows windows;
    /// c plus the bound, and depth_c plus the largest error (LeafOcclusion).
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
    /// are taken in the middle (X0, Y0) of the triangle's rectangle inside the packet. What is said
    /// of a point's ray holds in the rectangle, which LeafOcclusion holds it against; no ray of a
    /// camera's block that meets the rectangle is farther from there than half its extent and a
    /// block. So `reach` bounds |x - X z| + |y - Y z| of all vertices for them. Two vertices off by
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
        const VF farthest =
            kOnGrid ? hn::Add(half_extent, splat(frame_.block_extent)) : half_extent;
        const VF reach = hn::MulAdd(farthest, z_size, size);
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
        VF normal[3];
        plane_normal(px, py, z, normal);
        VF det =
            hn::MulAdd(px[0], normal[0], hn::MulAdd(py[0], normal[1], hn::Mul(z[0], normal[2])));
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
                normal[k] = hn::IfThenElseZero(sane, normal[k]);
            }
        }
        // The sign of det is that of edge functions inside: for a ray that the rule finds to hit
        // the triangle at z, det is z times their sum. It is off by `displacement` at most, 12
        // error size z_size by the vertices and the rest by rounding. So where it may have the
        // wrong sign, functions of a hit add up to no more than displacement / z; a vertex may be 1
        // / 16 nearer to the rule than it is here. What reaches to the eye is taken to be hit at
        // 2^-10 z_size or beyond: nearer hits on a triangle that is edge-on and reaches there are
        // not proven.
        const VF displacement = hn::Mul(splat(16.0f), hn::Mul(error, hn::Mul(size, z_size)));
        const Mask uncertain = hn::Ge(displacement, hn::Abs(det));
        const VF either_sign = hn::IfThenElse(in_front, hn::Mul(displacement, largest),
                                              hn::Mul(hn::Mul(splat(16.0f * 1024), error), size));
        bound = hn::IfThenElse(uncertain, hn::MulAdd(splat(1.1f), either_sign, bound), bound);
        const VF depth_a = hn::Mul(normal[0], signed_scale);
        const VF depth_b = hn::Mul(normal[1], signed_scale);
        const VF in_middle = hn::Mul(normal[2], signed_scale);
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
        // 1/z is that of the plane through the projected vertices. Let the rule's vertices be off
        // from these by up to `error` across, and w their weights for a ray that it finds to go
        // through them: z under w is that of the computed plane at a point that is at most `error`
        // from the ray, since the weighted mean of the displacements is. That plane changes z by
        // gradient * error of itself on the way. If it is sure to be less than half, which is so
        // unless `uncertain` (gradient is at most 8 size z_size / |det|), 1/z changes by at most
        // twice that. The vertices' own z are off by 4 units of 2^-24 (2^-19 has 32) and what
        // DepthBounds takes or the dilation of boxes leaves.
        // Rounding, in the same units: the normal's parts are 2 off of themselves, det = p0 *
        // normal 4 of the sum of its terms' magnitudes, at most |det| (1 + 2 gradient size), of
        // which the second part is below 2 gradient error; so `steep` has 4 of these. depth_a and
        // depth_b are 4 off of themselves, which counts half_extent (at most 66) far; moving the
        // plane's origin and the sums for a ray round 4 of in_middle and 200 of the gradient: 2^-14
        // of it has 1024 for both. Without fused operations the normal is off by 2 of its parts'
        // products, and det_error and sum_error come on top.
        const VF gradient = hn::Add(hn::Abs(depth_a), hn::Abs(depth_b));
        const VF steep = hn::Mul(hn::Mul(splat(4.0f), error), gradient);
        // Displacing the vertices moves det by 12 error size z_size: here by less than a fifth.
        const Mask sharp = hn::Lt(hn::Mul(splat(4.0f), displacement), hn::Abs(det));
        const RuleDepth rule = DepthBounds<kOnGrid>(frame_).find(
            {x, y, z, px, py, z_least, z_most, z_size, size, extent, half_extent, scale},
            hn::And(in_front, sharp));
        VF c0 = hn::Mul(splat(0x1p-14f + 1.01f * frame_.ray_error), gradient);
        VF c1 = hn::Add(hn::Add(splat(0x1p-19f), rule.by_q), steep);
#if !HWY_NATIVE_FMA
        const VF relative_size = hn::Mul(splat(0x1p-19f), hn::Mul(size, scale));
        const VF sum_error = hn::Mul(relative_size, hn::MulAdd(z_size, half_extent, size));
        const VF det_error = hn::Mul(relative_size, hn::Mul(size, z_size));
        c0 = hn::Add(c0, sum_error);
        c1 = hn::Add(c1, det_error);
#endif
        const auto known = [uncertain](VF value)
                               HWY_ATTR { return hn::IfThenZeroElse(uncertain, value); };
        const VF depth_c =
            hn::NegMulAdd(depth_a, middle_x, hn::NegMulAdd(depth_b, middle_y, in_middle));
        hn::Store(known(depth_a), f, setup.depth_a + l);
        hn::Store(known(depth_b), f, setup.depth_b + l);
        hn::Store(known(depth_c), f, setup.depth_c + l);
        if constexpr (kOnGrid) {
            // A ray that the rule may find to hit the triangle lies in its rectangle.
            const VF most_q = hn::MulAdd(gradient, half_extent, hn::Abs(in_middle));
            const VF most = hn::MulAdd(most_q, hn::MulAdd(most_q, rule.by_q2, c1), c0);
            hn::Store(hn::IfThenElse(uncertain, splat(1e35f), hn::Mul(most, splat(1.0001f))), f,
                      setup.error + l);
        } else {
            const VF nearest = nearest_q(hn::Sub(hn::Sub(z_least, z_error), rule.z));
            hn::Store(nearest, f, setup.q + l);
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

    /// a b - c d. Where there are fused operations, 2^-23 of itself off.
    static HWY_INLINE VF difference_of_two_products(VF a, VF b, VF c, VF d) {
        const VF right = hn::Mul(c, d);
#if HWY_NATIVE_FMA
        return hn::Add(hn::MulSub(a, b, right), hn::NegMulAdd(c, d, right));
#else
        return hn::MulSub(a, b, right);
#endif
    }

    /// The normal of the planes through triangles.
    static HWY_INLINE void plane_normal(const VF x[3], const VF y[3], const VF z[3], VF normal[3]) {
        const VF p[3] = {hn::Sub(x[1], x[0]), hn::Sub(y[1], y[0]), hn::Sub(z[1], z[0])};
        const VF q[3] = {hn::Sub(x[2], x[0]), hn::Sub(y[2], y[0]), hn::Sub(z[2], z[0])};
        for (int k = 0; k < 3; ++k) {
            const int i = (k + 1) % 3;
            const int j = (k + 2) % 3;
            normal[k] = difference_of_two_products(p[i], q[j], p[j], q[i]);
        }
    }

    const PacketFrame& frame_;
};

}  // namespace HWY_NAMESPACE
}  // namespace morphray::cpu
HWY_AFTER_NAMESPACE();

#endif
