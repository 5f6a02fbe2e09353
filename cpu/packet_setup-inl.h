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
#include "cpu/rule_vectors-inl.h"

HWY_BEFORE_NAMESPACE();
namespace morphray::cpu {
namespace HWY_NAMESPACE {

/// Sixteen triangles of a leaf, set up: edge functions a x + b y + c of the packet's plane,
/// positive inside; their bound; 1/z = sum * scale with an error of c0 + q (c1 + q
/// depth_error).
struct alignas(64) Setup {
    float a[3][16], b[3][16], c[3][16];
    float bound[16], scale[16], c0[16], c1[16], q[16];
    Rectangles rectangles;
};

/// kOnGrid: the packet is a camera's, whose rays are near the middles of pixels.
template <bool kOnGrid>
class TriangleSetup {
public:
    explicit TriangleSetup(const PacketFrame& frame) : frame_(frame) {}

    /// The triangles of the leaf that may concern a ray of the packet, as bits.
    std::uint32_t run(const Leaf& leaf, Setup& setup) const {
        std::uint32_t alive = set_up(leaf, setup);
        alive &= (1u << corner_triangle_count(leaf.vertex[0].corners)) - 1;
        if (HWY_UNLIKELY(has_invalid_vertex(leaf))) alive &= finite_triangles(leaf);
        if constexpr (kOnGrid) to_grid(setup.rectangles, frame_.grid_margin);
        return alive;
    }

private:
    static bool has_invalid_vertex(const Leaf& leaf) {
        for (const LeafVertex& v : leaf.vertex) {
            if (v.x > kSceneExtent) return true;
        }
        return false;
    }

    static std::uint32_t finite_triangles(const Leaf& leaf) {
        std::uint32_t finite = 0;
        for (std::uint32_t i = 0; i < kLeafTriangles; ++i) {
            float largest = -kSceneExtent;
            for (std::uint32_t k = 0; k < 3; ++k)
                largest = std::max(largest, leaf.vertex[corner(leaf.vertex[i].corners, k)].x);
            finite |= (largest <= kSceneExtent ? 1u : 0u) << i;
        }
        return finite;
    }

    /// Sets up all triangles of a leaf; which of them may cover a ray of the packet.
    ///
    /// Vertices: v0, the leaf's first, is projected in double; the others by rows * (v - v0), off
    /// by at most 5 * 2^-24 row_size extent from the product and 4 * 2^-24 of the result from the
    /// sums. The rule displaces a vertex by 2^-22 of its distance from the ray, for a ray through
    /// the triangle at most 8 * 2^-24 row_size extent: leaf_error has 16 for both. In x - X z and y
    /// - Y z for |X|, |Y| <= 17 that makes `error`, with the ray's own share. Edge functions are
    /// taken in the middle (X0, Y0) of the triangle's rectangle inside the packet; no ray of a
    /// block that meets the rectangle is farther from there than half its extent and a block, so
    /// `reach` bounds |x - X z| + |y - Y z| of all vertices for all of them. Two vertices off by
    /// error each move an edge function by at most 4 error reach (twice the first-order term), and
    /// its own rounding, with that of a X0 + b Y0, by at most 2^-21 reach (reach + 64 z).
    HWY_INLINE std::uint32_t set_up(const Leaf& leaf, Setup& setup) const {
        const Floats f;
        alignas(64) float vx[16], vy[16], vz[16];
        alignas(64) std::uint32_t corners[16];
        const float extent = project_vertices(leaf, vx, vy, vz, corners);
        const float leaf_error =
            0x1p-20f * (frame_.row_size[0] + frame_.row_size[1] + 34 * frame_.row_size[2]) * extent;
        std::uint32_t alive = 0;
        for (std::size_t l = 0; l < kLeafTriangles; l += hn::Lanes(f)) {
            VF x[3], y[3], z[3];
            gather_corners(vx, vy, vz, corners + l, x, y, z);
            alive |= mask_bits(set_up_triangles(x, y, z, leaf_error, setup, l)) << l;
        }
        return alive;
    }

    HWY_INLINE float project_vertices(const Leaf& leaf, float* vx, float* vy, float* vz,
                                      std::uint32_t* corners) const {
        const Floats f;
        // A vertex that is not finite is put where v0 is: its triangles are left out afterwards.
        const LeafVertex* first = leaf.vertex;
        while (first->x > kSceneExtent && first != leaf.vertex + kLeafVertices - 1) ++first;
        const LeafVertex& v0 = *first;
        const double p[3] = {double{v0.x} - frame_.org.x, double{v0.y} - frame_.org.y,
                             double{v0.z} - frame_.org.z};
        float h[3];
        for (int k = 0; k < 3; ++k) {
            h[k] = static_cast<float>(frame_.rows[k][0] * p[0] + frame_.rows[k][1] * p[1] +
                                      frame_.rows[k][2] * p[2]);
        }
        VF extent = hn::Zero(f);
        float* const out[3] = {vx, vy, vz};
        for (std::size_t l = 0; l < kLeafVertices; l += hn::Lanes(f)) {
            VF x, y, z, w;
            hn::LoadInterleaved4(f, &leaf.vertex[l].x, x, y, z, w);
            hn::Store(hn::BitCast(Words(), w), Words(), corners + l);
            const Mask finite = hn::Le(x, splat(kSceneExtent));
            x = hn::IfThenElseZero(finite, hn::Sub(x, splat(v0.x)));
            y = hn::IfThenElseZero(finite, hn::Sub(y, splat(v0.y)));
            z = hn::IfThenElseZero(finite, hn::Sub(z, splat(v0.z)));
            extent = hn::Max(extent, hn::Max(hn::Abs(x), hn::Max(hn::Abs(y), hn::Abs(z))));
            for (int k = 0; k < 3; ++k) {
                const float* row = frame_.rows_f[k];
                const VF sum = hn::MulAdd(
                    splat(row[0]), x,
                    hn::MulAdd(splat(row[1]), y, hn::MulAdd(splat(row[2]), z, splat(h[k]))));
                hn::Store(sum, f, out[k] + l);
            }
        }
        return hn::GetLane(hn::MaxOfLanes(f, extent));
    }

    HWY_INLINE void gather_corners(const float* vx, const float* vy, const float* vz,
                                   const std::uint32_t* corners, VF x[3], VF y[3], VF z[3]) const {
        const Floats f;
        const hn::RebindToSigned<Floats> ints;
        const VW packed = hn::Load(Words(), corners);
        const VW byte = hn::Set(Words(), 0xFFu);
        const VW slot[3] = {hn::And(packed, byte), hn::And(hn::ShiftRight<8>(packed), byte),
                            hn::And(hn::ShiftRight<16>(packed), byte)};
        for (int k = 0; k < 3; ++k) {
            if constexpr (hn::MaxLanes(Floats()) == 16) {
                const auto index = hn::IndicesFromVec(f, slot[k]);
                x[k] = hn::TableLookupLanes(hn::Load(f, vx), index);
                y[k] = hn::TableLookupLanes(hn::Load(f, vy), index);
                z[k] = hn::TableLookupLanes(hn::Load(f, vz), index);
            } else {
                const auto index = hn::BitCast(ints, slot[k]);
                x[k] = hn::GatherIndex(f, vx, index);
                y[k] = hn::GatherIndex(f, vy, index);
                z[k] = hn::GatherIndex(f, vz, index);
            }
        }
    }

    HWY_INLINE Mask set_up_triangles(const VF x[3], const VF y[3], const VF z[3], float leaf_error,
                                     Setup& setup, std::size_t l) const {
        const Floats f;
        const VF zero = hn::Zero(f);
        const VF half = splat(0.5f);
        const VF z_least = hn::Min(z[0], hn::Min(z[1], z[2]));
        const VF z_most = hn::Max(z[0], hn::Max(z[1], z[2]));
        const VF z_size = hn::Max(hn::Abs(z_least), hn::Abs(z_most));
        const VF z_error = hn::MulAdd(splat(0x1p-22f), z_size, splat(leaf_error));

        // The rectangle, where the triangle is well in front of the eye.
        const Mask in_front =
            hn::Gt(z_least, hn::MulAdd(splat(0x1p-10f), z_size, splat(16 * leaf_error)));
        const VF safe_least = hn::IfThenElse(in_front, z_least, splat(1.0f));
        const VF margin = hn::Add(hn::Div(splat(2 * leaf_error), safe_least),
                                  splat(2 * frame_.ray_error + 0x1p-16f));
        VF rx[3], ry[3];
        for (int k = 0; k < 3; ++k) {
            const VF rz = hn::Div(splat(1.0f), hn::IfThenElse(in_front, z[k], splat(1.0f)));
            rx[k] = hn::Mul(x[k], rz);
            ry[k] = hn::Mul(y[k], rz);
        }
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
        hn::Store(lower_x, f, setup.rectangles.lower_x + l);
        hn::Store(upper_x, f, setup.rectangles.upper_x + l);
        hn::Store(lower_y, f, setup.rectangles.lower_y + l);
        hn::Store(upper_y, f, setup.rectangles.upper_y + l);
        const VF cut_lower_x = hn::Max(lower_x, splat(frame_.lower_x));
        const VF cut_upper_x = hn::Min(upper_x, splat(frame_.upper_x));
        const VF cut_lower_y = hn::Max(lower_y, splat(frame_.lower_y));
        const VF cut_upper_y = hn::Min(upper_y, splat(frame_.upper_y));
        Mask meets =
            hn::And(hn::And(hn::Le(cut_lower_x, cut_upper_x), hn::Le(cut_lower_y, cut_upper_y)),
                    hn::Gt(hn::Add(z_most, z_error), zero));
        if constexpr (kOnGrid) {
            // Most small triangles cover no pixel's middle, x = k + 0.5 for whole k, at all.
            const VF above = splat(0.5f + frame_.grid_margin);
            const VF below = splat(0.5f - frame_.grid_margin);
            const auto covers = [&](VF low, VF high) {
                return hn::Le(hn::Ceil(hn::Sub(low, above)), hn::Floor(hn::Sub(high, below)));
            };
            meets = hn::And(meets, hn::And(covers(lower_x, upper_x), covers(lower_y, upper_y)));
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
        const VF error =
            hn::MulAdd(splat(0x1p-21f), reach,
                       hn::MulAdd(splat(0x1p-16f + frame_.ray_error), z_size, splat(leaf_error)));
        const VF rounding =
            hn::Mul(splat(0x1p-21f), hn::Mul(reach, hn::MulAdd(splat(64.0f), z_size, reach)));
        const VF bound = hn::MulAdd(hn::Mul(splat(4.0f), error), hn::Add(reach, error), rounding);

        VF a[3], b[3], c[3];
        const auto edge = [&](int k, int i, int j) {
            a[k] = hn::MulSub(py[i], z[j], hn::Mul(z[i], py[j]));
            b[k] = hn::MulSub(z[i], px[j], hn::Mul(px[i], z[j]));
            c[k] = hn::MulSub(px[i], py[j], hn::Mul(py[i], px[j]));
        };
        edge(0, 1, 2);
        edge(1, 2, 0);
        edge(2, 0, 1);
        const VF det = hn::MulAdd(px[0], a[0], hn::MulAdd(py[0], b[0], hn::Mul(z[0], c[0])));
        const VF sign = hn::And(det, splat(-0.0f));
        const VF scale = hn::Div(splat(1.0f), hn::Max(hn::Abs(det), splat(1e-30f)));
        // What overflows (eyes and vertices very far away) leaves everything in doubt. All else
        // follows from the two, since reach bounds the vertices and 2^-21 reach^2 is a part of the
        // bound.
        const Mask sane = hn::And(hn::Lt(bound, splat(1e28f)), hn::Lt(hn::Abs(det), splat(1e34f)));
        hn::Store(hn::IfThenElseZero(sane, scale), f, setup.scale + l);
        hn::Store(hn::IfThenElse(sane, bound, splat(1e35f)), f, setup.bound + l);
        for (int k = 0; k < 3; ++k) {
            a[k] = hn::IfThenElseZero(sane, a[k]);
            b[k] = hn::IfThenElseZero(sane, b[k]);
            c[k] = hn::IfThenElseZero(sane, c[k]);
            const VF ak = hn::Xor(a[k], sign);
            const VF bk = hn::Xor(b[k], sign);
            const VF ck = hn::Xor(c[k], sign);
            hn::Store(ak, f, setup.a[k] + l);
            hn::Store(bk, f, setup.b[k] + l);
            hn::Store(hn::NegMulAdd(ak, middle_x, hn::NegMulAdd(bk, middle_y, ck)), f,
                      setup.c[k] + l);
        }
        store_depth_errors(a, b, hn::IfThenElseZero(sane, det), scale, error, rounding, z_size,
                           size, setup, l);
        hn::Store(nearest_q(frame_, hn::Sub(z_least, z_error)), f, setup.q + l);
        return meets;
    }

    /// 1/z is that of the plane through the projected vertices, up to rounding; displacing the
    /// vertices by `error` moves it by its gradient times that, while the displacement is small
    /// against the triangle. Where it is not, nothing is certain.
    HWY_INLINE void store_depth_errors(const VF a[3], const VF b[3], VF det, VF scale, VF error,
                                       VF rounding, VF z_size, VF size, Setup& setup,
                                       std::size_t l) const {
        const Floats f;
        const VF gradient = hn::Add(hn::Abs(hn::Add(hn::Add(a[0], a[1]), a[2])),
                                    hn::Abs(hn::Add(hn::Add(b[0], b[1]), b[2])));
        const VF steep = hn::Mul(hn::Mul(splat(8.0f), error), hn::Mul(gradient, scale));
        // Of det: products of size * size * z, nine of them.
        const VF det_error =
            hn::Mul(splat(0x1p-20f), hn::Mul(hn::Mul(size, size), hn::Mul(z_size, scale)));
        const VF c1 = hn::Add(splat(0x1p-17f), hn::Add(steep, det_error));
        const VF c0 = hn::Mul(hn::Mul(splat(4.0f), rounding), scale);
        const Mask doubtful =
            hn::Ge(hn::Mul(splat(16.0f), hn::Mul(error, hn::Mul(size, z_size))), hn::Abs(det));
        hn::Store(hn::IfThenElse(doubtful, splat(1e35f), c0), f, setup.c0 + l);
        hn::Store(hn::IfThenZeroElse(doubtful, c1), f, setup.c1 + l);
    }

    const PacketFrame& frame_;
};

}  // namespace HWY_NAMESPACE
}  // namespace morphray::cpu
HWY_AFTER_NAMESPACE();

#endif
