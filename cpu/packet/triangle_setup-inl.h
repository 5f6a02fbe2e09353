// Setting up the triangles of a leaf in the plane of a packet, with bounds of every error.

#if defined(MORPHRAY_CPU_PACKET_TRIANGLE_SETUP_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_PACKET_TRIANGLE_SETUP_INL_H
#undef MORPHRAY_CPU_PACKET_TRIANGLE_SETUP_INL_H
#else
#define MORPHRAY_CPU_PACKET_TRIANGLE_SETUP_INL_H
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cstdint>

#include "common/interop/bvh_layout.h"
#include "common/interop/packet_bounds.h"
#include "cpu/packet/depth_bounds-inl.h"
#include "cpu/packet/packet.h"
#include "cpu/packet/packet_blocks-inl.h"
#include "cpu/packet/packet_vertices-inl.h"
#include "cpu/simd/rule_vectors-inl.h"

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
///
/// Every bound is stated in units of 2^-24 and proved in docs/design/arithmetic.md, "Packets", by
/// the same names: the constants are those of common/interop/packet_bounds.h.
template <bool kOnGrid>
class TriangleSetup {
public:
    explicit TriangleSetup(const PacketFrame& frame)
        : frame_(frame),
          row_sizes_(frame.row_size[0] + frame.row_size[1] + 2 * frame.reach * frame.row_size[2]) {}

    /// The triangles of the leaf that may concern a ray of the packet, as bits.
    std::uint32_t run(const Leaf& leaf, Setup& setup) const {
        bool all_finite = true;
        std::uint32_t alive = set_up(leaf, setup, all_finite);
        alive &= (1u << corner_triangle_count(leaf.vertex[0].corners)) - 1;
        if (HWY_UNLIKELY(!all_finite)) alive &= finite_triangles(leaf);
        return alive;
    }

private:
    /// The vertices of as many triangles as there are lanes, in the packet's projection.
    struct Vertices {
        VF x[3], y[3], z[3];
        /// The largest coordinate relative to the leaf's first vertex, in scene space.
        VF extent;
        /// How far x - X z and y - Y z of a vertex may be off together for a ray (X, Y), as far as
        /// that grows with the extent and the distance, the rule's displacement included.
        VF leaf_error;
        VF z_least, z_most, z_size;
        /// How far z may be off.
        VF z_error;
    };

    /// Where triangles are seen: rectangles in the plane, and the part of them in the packet.
    struct Places {
        VF lower_x, upper_x, lower_y, upper_y;
        VF middle_x, middle_y;
        /// How far |x| + |y| of a ray in the part may be from the middle's.
        VF half_extent;
        /// Where all vertices are well in front of the origin; and the largest 1 / z there.
        Mask in_front;
        VF largest_q;
        /// Where the rectangle meets the packet.
        Mask meets;
    };

    /// Vertices as the ray in the middle of a triangle's part sees them, and what follows from
    /// that.
    struct Laterals {
        VF x[3], y[3];
        /// The largest |x| + |y|, and that for any ray of the part.
        VF size, reach;
        /// How far |x| + |y| may be off from those of the rule's displaced vertices.
        VF error;
    };

    /// Planes through the origin and an edge, and that of a triangle; det is 6 times the volume
    /// that the triangle and the origin span, with its sign.
    struct PlaneSet {
        VF a[3], b[3], c[3];
        VF bound;
        VF normal[3];
        VF det;
        /// How far det may be off from what a hit of the rule sees: if |det| is more, its sign is
        /// that of the edge functions inside.
        VF det_error;
    };

    HWY_INLINE std::uint32_t set_up(const Leaf& leaf, Setup& setup, bool& all_finite) const {
        const Floats f;
        alignas(64) float vx[16], vy[16], vz[16], sizes[16];
        alignas(64) std::uint32_t corners[16];
        float distance;
        all_finite = project_vertices(frame_, leaf, vx, vy, vz, sizes, corners, distance);
        const VF far_error =
            splat(row_sizes_ * (kDistanceError * distance + kGridError) + kPlaneFloor);
        std::uint32_t alive = 0;
        for (std::size_t l = 0; l < kLeafTriangles; l += hn::Lanes(f)) {
            Vertices v;
            VF size[3];
            const VW packed = hn::Load(Words(), corners + l);
            gather_corners(vx, packed, v.x);
            gather_corners(vy, packed, v.y);
            gather_corners(vz, packed, v.z);
            gather_corners(sizes, packed, size);
            v.extent = hn::Max(size[0], hn::Max(size[1], size[2]));
            v.leaf_error = hn::MulAdd(splat(kExtentError * row_sizes_), v.extent, far_error);
            v.z_least = hn::Min(v.z[0], hn::Min(v.z[1], v.z[2]));
            v.z_most = hn::Max(v.z[0], hn::Max(v.z[1], v.z[2]));
            v.z_size = hn::Max(hn::Abs(v.z_least), hn::Abs(v.z_most));
            v.z_error = hn::MulAdd(splat(kDepthError), v.z_size, v.leaf_error);
            alive |= mask_bits(set_up_triangles(v, setup, l)) << l;
        }
        return alive;
    }

    HWY_INLINE Mask set_up_triangles(const Vertices& v, Setup& setup, std::size_t l) const {
        const Places places = find_places(v, setup, l);
        const Laterals laterals = find_laterals(v, places);
        PlaneSet planes = find_planes(v, places, laterals);
        const VF sign = hn::And(planes.det, splat(-0.0f));
        const Mask oriented = orient(places, planes);
        store_edges(places, planes, sign, setup, l);
        store_depth(v, places, laterals, planes, sign, oriented, setup, l);
        return places.meets;
    }

    /// The rectangles: a ray through a triangle of the rule is a mean of its displaced vertices, so
    /// it lies between their x / z where all z are positive. Of triangles that are not well in
    /// front of the origin it is all of the plane.
    HWY_INLINE Places find_places(const Vertices& v, Setup& setup, std::size_t l) const {
        const Floats f;
        const VF least = splat(1e-10f);
        const VF near = hn::MulAdd(splat(0x1p-10f), v.z_size, hn::Mul(splat(16.0f), v.leaf_error));
        Places p;
        p.in_front = hn::Gt(v.z_least, hn::Max(near, least));
        VF rx[3], ry[3];
        p.largest_q = hn::Zero(f);
        for (int k = 0; k < 3; ++k) {
            const VF rz = hn::Div(splat(1.0f), hn::Max(v.z[k], least));
            p.largest_q = hn::Max(p.largest_q, rz);
            rx[k] = hn::Mul(v.x[k], rz);
            ry[k] = hn::Mul(v.y[k], rz);
        }
        const VF margin =
            hn::MulAdd(hn::Mul(splat(kRectangleError), v.leaf_error), p.largest_q,
                       splat(kRectangleError * frame_.ray_error + kRectangleRounding));
        const VF all = splat(1e6f);
        const auto lower = [&](const VF r[3]) HWY_ATTR {
            const VF low = hn::Min(r[0], hn::Min(r[1], r[2]));
            const VF out = hn::NegMulAdd(splat(kQuotientError), hn::Abs(low), low);
            return hn::IfThenElse(p.in_front, hn::Sub(out, margin), hn::Neg(all));
        };
        const auto upper = [&](const VF r[3]) HWY_ATTR {
            const VF high = hn::Max(r[0], hn::Max(r[1], r[2]));
            const VF out = hn::MulAdd(splat(kQuotientError), hn::Abs(high), high);
            return hn::IfThenElse(p.in_front, hn::Add(out, margin), all);
        };
        p.lower_x = lower(rx);
        p.upper_x = upper(rx);
        p.lower_y = lower(ry);
        p.upper_y = upper(ry);
        const VF cut_lower_x = hn::Max(p.lower_x, splat(frame_.lower_x));
        const VF cut_upper_x = hn::Min(p.upper_x, splat(frame_.upper_x));
        const VF cut_lower_y = hn::Max(p.lower_y, splat(frame_.lower_y));
        const VF cut_upper_y = hn::Min(p.upper_y, splat(frame_.upper_y));
        p.meets = hn::Gt(hn::Add(v.z_most, v.z_error), hn::Zero(f));
        if constexpr (kOnGrid) {
            // Most small triangles cover no pixel's middle at all.
            const PixelRange pixels_x(p.lower_x, p.upper_x, 0, frame_.grid_columns);
            const PixelRange pixels_y(p.lower_y, p.upper_y, 0, frame_.grid_rows);
            setup.windows.set(l, pixels_x, pixels_y);
            p.meets = hn::And(p.meets, hn::And(pixels_x.any(), pixels_y.any()));
        } else {
            hn::Store(p.lower_x, f, setup.rectangles.lower_x + l);
            hn::Store(p.upper_x, f, setup.rectangles.upper_x + l);
            hn::Store(p.lower_y, f, setup.rectangles.lower_y + l);
            hn::Store(p.upper_y, f, setup.rectangles.upper_y + l);
            p.meets = hn::And(p.meets, hn::And(hn::Le(cut_lower_x, cut_upper_x),
                                               hn::Le(cut_lower_y, cut_upper_y)));
        }
        const VF half = splat(0.5f);
        p.middle_x = hn::Mul(half, hn::Add(cut_lower_x, cut_upper_x));
        p.middle_y = hn::Mul(half, hn::Add(cut_lower_y, cut_upper_y));
        p.half_extent = hn::Mul(
            half, hn::Add(hn::Sub(cut_upper_x, cut_lower_x), hn::Sub(cut_upper_y, cut_lower_y)));
        return p;
    }

    /// No ray of a camera's block that meets the rectangle is farther from the middle than
    /// half_extent and a block.
    HWY_INLINE Laterals find_laterals(const Vertices& v, const Places& p) const {
        Laterals s;
        s.size = hn::Zero(Floats());
        for (int k = 0; k < 3; ++k) {
            s.x[k] = hn::NegMulAdd(p.middle_x, v.z[k], v.x[k]);
            s.y[k] = hn::NegMulAdd(p.middle_y, v.z[k], v.y[k]);
            s.size = hn::Max(s.size, hn::Add(hn::Abs(s.x[k]), hn::Abs(s.y[k])));
        }
        const VF farthest =
            kOnGrid ? hn::Add(p.half_extent, splat(frame_.block_extent)) : p.half_extent;
        s.reach = hn::MulAdd(farthest, v.z_size, s.size);
        s.error = hn::MulAdd(splat(kLateralError), s.size,
                             hn::MulAdd(splat(kShearError * frame_.reach), v.z_size, v.leaf_error));
        return s;
    }

    HWY_INLINE PlaneSet find_planes(const Vertices& v, const Places& p, const Laterals& s) const {
        PlaneSet planes;
        const auto edge = [&](int k, int i, int j) HWY_ATTR {
            planes.a[k] = hn::MulSub(s.y[i], v.z[j], hn::Mul(v.z[i], s.y[j]));
            planes.b[k] = hn::MulSub(v.z[i], s.x[j], hn::Mul(s.x[i], v.z[j]));
            planes.c[k] = hn::MulSub(s.x[i], s.y[j], hn::Mul(s.y[i], s.x[j]));
        };
        edge(0, 1, 2);
        edge(1, 2, 0);
        edge(2, 0, 1);
        VF slope = hn::Zero(Floats());
        for (int k = 0; k < 3; ++k)
            slope = hn::Max(slope, hn::Add(hn::Abs(planes.a[k]), hn::Abs(planes.b[k])));
        const VF rounding =
            hn::Mul(hn::Mul(splat(kEdgeRounding), s.size),
                    hn::MulAdd(splat(kShearRounding * frame_.reach), v.z_size, s.reach));
        planes.bound = hn::MulAdd(
            splat(kRayError * frame_.ray_error), slope,
            hn::MulAdd(hn::Mul(splat(2.0f), s.error), hn::Add(s.reach, s.error), rounding));
        plane_normal(s.x, s.y, v.z, planes.normal);
        planes.det =
            hn::MulAdd(s.x[0], planes.normal[0],
                       hn::MulAdd(s.y[0], planes.normal[1], hn::Mul(v.z[0], planes.normal[2])));
        // Of rays in the rectangle, whether or not a block reaches farther.
        const VF hit_reach = hn::MulAdd(p.half_extent, v.z_size, hn::Add(s.size, s.error));
        const VF volume_error = hn::MulAdd(splat(kVolumeExtentError * frame_.row_size[2]), v.extent,
                                           hn::Mul(splat(kVolumeRounding), v.z_size));
        planes.det_error = hn::Mul(
            hit_reach, hn::MulAdd(hit_reach, volume_error,
                                  hn::Mul(splat(kVolumeError), hn::Mul(s.error, v.z_size))));
        return planes;
    }

    /// Where the sign of det is certain. Elsewhere a hit may have edge functions of either sign:
    /// they add up to det / z, with z no nearer than a vertex, so that where all vertices are well
    /// in front of the origin a larger bound covers both signs. Where they are not, and where
    /// something overflows, nothing is known of the triangle, and the rule is asked for every ray.
    HWY_INLINE Mask orient(const Places& p, PlaneSet& planes) const {
        const Floats f;
        const VF size = hn::Abs(planes.det);
        const Mask oriented = hn::Gt(size, planes.det_error);
        const VF either_sign = hn::Mul(hn::Mul(splat(kEitherSign), planes.det_error), p.largest_q);
        planes.bound = hn::IfThenElse(oriented, planes.bound, hn::Add(planes.bound, either_sign));
        const Mask usable =
            hn::And(hn::Or(oriented, p.in_front), hn::Lt(planes.bound, splat(1e28f)));
        const Mask known = hn::And(usable, hn::Lt(size, splat(1e34f)));
        if (HWY_LIKELY(hn::AllTrue(f, known))) return oriented;
        planes.bound = hn::IfThenElse(known, planes.bound, splat(1e35f));
        planes.det = hn::IfThenElseZero(known, planes.det);
        for (int k = 0; k < 3; ++k) {
            planes.a[k] = hn::IfThenElseZero(known, planes.a[k]);
            planes.b[k] = hn::IfThenElseZero(known, planes.b[k]);
            planes.c[k] = hn::IfThenElseZero(known, planes.c[k]);
            planes.normal[k] = hn::IfThenElseZero(known, planes.normal[k]);
        }
        return hn::And(oriented, known);
    }

    HWY_INLINE void store_edges(const Places& p, const PlaneSet& planes, VF sign, Setup& setup,
                                std::size_t l) const {
        const Floats f;
        hn::Store(planes.bound, f, setup.bound + l);
        const VF most_bound = hn::Mul(splat(kLosingBound), planes.bound);
        for (int k = 0; k < 3; ++k) {
            const VF a = hn::Xor(planes.a[k], sign);
            const VF b = hn::Xor(planes.b[k], sign);
            const VF c = hn::NegMulAdd(a, p.middle_x,
                                       hn::NegMulAdd(b, p.middle_y, hn::Xor(planes.c[k], sign)));
            hn::Store(a, f, setup.a[k] + l);
            hn::Store(b, f, setup.b[k] + l);
            hn::Store(c, f, setup.c[k] + l);
            if constexpr (!kOnGrid) hn::Store(hn::Add(c, most_bound), f, setup.most_c[k] + l);
        }
    }

    /// 1/z is that of the plane through the projected vertices. For a hit of the rule the mean of
    /// these under its weights is a point of that plane that is no farther than the error of a
    /// vertex from the ray; so 1/z is off by gradient * error of itself, which is certainly less
    /// than a quarter where |det| is more than kKnownVolume times its error. Elsewhere nothing is
    /// known of 1/z.
    HWY_INLINE void store_depth(const Vertices& v, const Places& p, const Laterals& s,
                                const PlaneSet& planes, VF sign, Mask oriented, Setup& setup,
                                std::size_t l) const {
        const Floats f;
        const VF det = hn::Abs(planes.det);
        const Mask has_depth =
            hn::And(oriented, hn::Gt(det, hn::Mul(splat(kKnownVolume), planes.det_error)));
        const VF scale = hn::Div(splat(1.0f), hn::Max(det, splat(1e-30f)));
        const auto known = [has_depth](VF value)
                               HWY_ATTR { return hn::IfThenElseZero(has_depth, value); };
        const VF signed_scale = known(hn::Or(scale, sign));
        const VF depth_a = hn::Mul(planes.normal[0], signed_scale);
        const VF depth_b = hn::Mul(planes.normal[1], signed_scale);
        const VF in_middle = hn::Mul(planes.normal[2], signed_scale);
        const VF depth_c =
            hn::NegMulAdd(depth_a, p.middle_x, hn::NegMulAdd(depth_b, p.middle_y, in_middle));
        hn::Store(depth_a, f, setup.depth_a + l);
        hn::Store(depth_b, f, setup.depth_b + l);
        hn::Store(depth_c, f, setup.depth_c + l);
        const VF gradient = hn::Add(hn::Abs(depth_a), hn::Abs(depth_b));
        const VF plane_error = hn::MulAdd(splat(kPlaneError), s.size, s.error);
        const VF steep = hn::Mul(hn::Mul(splat(kSteepError), plane_error), gradient);
        const RuleDepth rule =
            DepthBounds<kOnGrid>(frame_).find({v.x, v.y, v.z, s.x, s.y, v.z_least, v.z_most,
                                               v.z_size, s.size, v.extent, p.half_extent, scale},
                                              hn::And(p.in_front, has_depth));
        VF c0 = hn::Mul(splat(kGradientRounding + kRayError * frame_.ray_error), gradient);
        VF c1 = hn::Add(hn::Add(splat(kReciprocalRounding), rule.by_q), steep);
#if !HWY_NATIVE_FMA
        // Without fused operations the normal is off by 2 u of its parts' products.
        const VF relative_size = hn::Mul(splat(kUnfusedNormal), hn::Mul(s.size, scale));
        const VF sum_error = hn::Mul(relative_size, hn::MulAdd(v.z_size, p.half_extent, s.size));
        const VF det_error = hn::Mul(relative_size, hn::Mul(s.size, v.z_size));
        c0 = hn::Add(c0, sum_error);
        c1 = hn::Add(c1, det_error);
#endif
        c0 = hn::IfThenElse(has_depth, c0, splat(1e35f));
        c1 = known(c1);
        if constexpr (kOnGrid) {
            // A ray that the rule may find to hit the triangle lies in its rectangle.
            const VF most_q = hn::MulAdd(gradient, p.half_extent, hn::Abs(in_middle));
            const VF most = hn::MulAdd(most_q, hn::MulAdd(most_q, rule.by_q2, c1), c0);
            const Mask is_far = hn::Le(hn::Mul(most_q, rule.by_q2), splat(kFarDepth));
            const VF error = hn::IfThenElse(is_far, hn::Mul(most, splat(1.0001f)), splat(1e35f));
            hn::Store(error, f, setup.error + l);
        } else {
            const VF nearest = nearest_q(hn::Sub(hn::Sub(v.z_least, v.z_error), rule.z));
            hn::Store(nearest, f, setup.q + l);
            hn::Store(c0, f, setup.c0 + l);
            hn::Store(c1, f, setup.c1 + l);
            hn::Store(rule.by_q2, f, setup.c2 + l);
            const VF most = hn::MulAdd(nearest, hn::MulAdd(nearest, rule.by_q2, c1), c0);
            const VF rounded =
                hn::MulAdd(splat(kLosingGradient), gradient, hn::Mul(splat(1 + 0x1p-18f), most));
            hn::Store(hn::Add(depth_c, rounded), f, setup.most_q + l);
        }
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
    /// What a step in x, y and z of scene space adds to x - X z and y - Y z together, at most.
    float row_sizes_;
};

}  // namespace HWY_NAMESPACE
}  // namespace morphray::cpu
HWY_AFTER_NAMESPACE();

#endif
