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
#include "cpu/simd/fast_hit_rule-inl.h"

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
        FloatVec x[3], y[3], z[3];
        /// The largest coordinate relative to the leaf's first vertex, in scene space.
        FloatVec extent;
        /// How far x - X z and y - Y z of a vertex may be off together for a ray (X, Y), as far as
        /// that grows with the extent and the distance, the rule's displacement included.
        FloatVec leaf_error;
        FloatVec z_least, z_most, z_size;
        /// How far z may be off.
        FloatVec z_error;
    };

    /// Where triangles are seen: rectangles in the plane, and the part of them in the packet.
    struct Places {
        FloatVec lower_x, upper_x, lower_y, upper_y;
        FloatVec middle_x, middle_y;
        /// How far |x| + |y| of a ray in the part may be from the middle's.
        FloatVec half_extent;
        /// Where all vertices are well in front of the origin; and the largest 1 / z there.
        Mask in_front;
        FloatVec largest_q;
        /// Where the rectangle meets the packet.
        Mask meets;
    };

    /// Vertices as the ray in the middle of a triangle's part sees them, and what follows from
    /// that.
    struct Laterals {
        FloatVec x[3], y[3];
        /// The largest |x| + |y|, and that for any ray of the part.
        FloatVec size, reach;
        /// How far |x| + |y| may be off from those of the rule's displaced vertices.
        FloatVec error;
    };

    /// Planes through the origin and an edge, and that of a triangle; det is 6 times the volume
    /// that the triangle and the origin span, with its sign.
    struct PlaneSet {
        FloatVec a[3], b[3], c[3];
        FloatVec bound;
        FloatVec normal[3];
        FloatVec det;
        /// How far det may be off from what a hit of the rule sees: if |det| is more, its sign is
        /// that of the edge functions inside.
        FloatVec det_error;
    };

    HWY_INLINE std::uint32_t set_up(const Leaf& leaf, Setup& setup, bool& all_finite) const {
        alignas(64) float vx[16], vy[16], vz[16], sizes[16];
        alignas(64) std::uint32_t corners[16];
        float distance;
        all_finite = project_vertices(frame_, leaf, vx, vy, vz, sizes, corners, distance);
        const FloatVec far_error =
            splat(row_sizes_ * (kDistanceError * distance + kGridError) + kPlaneFloor);
        std::uint32_t alive = 0;
        for (std::size_t l = 0; l < kLeafTriangles; l += kLanes) {
            Vertices v;
            FloatVec size[3];
            const UintVec packed = load(corners + l);
            gather_corners(vx, packed, v.x);
            gather_corners(vy, packed, v.y);
            gather_corners(vz, packed, v.z);
            gather_corners(sizes, packed, size);
            v.extent = max(size[0], max(size[1], size[2]));
            v.leaf_error = mul_add(splat(kExtentError * row_sizes_), v.extent, far_error);
            v.z_least = min(v.z[0], min(v.z[1], v.z[2]));
            v.z_most = max(v.z[0], max(v.z[1], v.z[2]));
            v.z_size = max(abs(v.z_least), abs(v.z_most));
            v.z_error = mul_add(splat(kDepthError), v.z_size, v.leaf_error);
            alive |= bits_of(set_up_triangles(v, setup, l)) << l;
        }
        return alive;
    }

    HWY_INLINE Mask set_up_triangles(const Vertices& v, Setup& setup, std::size_t l) const {
        const Places places = find_places(v, setup, l);
        const Laterals laterals = find_laterals(v, places);
        PlaneSet planes = find_planes(v, places, laterals);
        const FloatVec sign = planes.det & splat(-0.0f);
        const Mask oriented = orient(places, planes);
        store_edges(places, planes, sign, setup, l);
        store_depth(v, places, laterals, planes, sign, oriented, setup, l);
        return places.meets;
    }

    /// The rectangles: a ray through a triangle of the rule is a mean of its displaced vertices, so
    /// it lies between their x / z where all z are positive. Of triangles that are not well in
    /// front of the origin it is all of the plane.
    HWY_INLINE Places find_places(const Vertices& v, Setup& setup, std::size_t l) const {
        const FloatVec least = splat(1e-10f);
        const FloatVec near = mul_add(splat(0x1p-10f), v.z_size, splat(16.0f) * v.leaf_error);
        Places p;
        p.in_front = v.z_least > max(near, least);
        FloatVec rx[3], ry[3];
        p.largest_q = zero();
        for (int k = 0; k < 3; ++k) {
            const FloatVec rz = splat(1.0f) / max(v.z[k], least);
            p.largest_q = max(p.largest_q, rz);
            rx[k] = v.x[k] * rz;
            ry[k] = v.y[k] * rz;
        }
        const FloatVec margin =
            mul_add(splat(kRectangleError) * v.leaf_error, p.largest_q,
                    splat(kRectangleError * frame_.ray_error + kRectangleRounding));
        const FloatVec all = splat(1e6f);
        const auto lower = [&](const FloatVec r[3]) HWY_ATTR {
            const FloatVec low = min(r[0], min(r[1], r[2]));
            const FloatVec out = neg_mul_add(splat(kQuotientError), abs(low), low);
            return select(p.in_front, out - margin, -all);
        };
        const auto upper = [&](const FloatVec r[3]) HWY_ATTR {
            const FloatVec high = max(r[0], max(r[1], r[2]));
            const FloatVec out = mul_add(splat(kQuotientError), abs(high), high);
            return select(p.in_front, out + margin, all);
        };
        p.lower_x = lower(rx);
        p.upper_x = upper(rx);
        p.lower_y = lower(ry);
        p.upper_y = upper(ry);
        const FloatVec cut_lower_x = max(p.lower_x, splat(frame_.lower_x));
        const FloatVec cut_upper_x = min(p.upper_x, splat(frame_.upper_x));
        const FloatVec cut_lower_y = max(p.lower_y, splat(frame_.lower_y));
        const FloatVec cut_upper_y = min(p.upper_y, splat(frame_.upper_y));
        p.meets = v.z_most + v.z_error > zero();
        if constexpr (kOnGrid) {
            // Most small triangles cover no pixel's middle at all.
            const PixelRange pixels_x(p.lower_x, p.upper_x, 0, frame_.grid_columns);
            const PixelRange pixels_y(p.lower_y, p.upper_y, 0, frame_.grid_rows);
            setup.windows.set(l, pixels_x, pixels_y);
            p.meets = p.meets & (pixels_x.any() & pixels_y.any());
        } else {
            store(p.lower_x, setup.rectangles.lower_x + l);
            store(p.upper_x, setup.rectangles.upper_x + l);
            store(p.lower_y, setup.rectangles.lower_y + l);
            store(p.upper_y, setup.rectangles.upper_y + l);
            p.meets = p.meets & ((cut_lower_x <= cut_upper_x) & (cut_lower_y <= cut_upper_y));
        }
        const FloatVec half = splat(0.5f);
        p.middle_x = half * (cut_lower_x + cut_upper_x);
        p.middle_y = half * (cut_lower_y + cut_upper_y);
        p.half_extent = half * (cut_upper_x - cut_lower_x + (cut_upper_y - cut_lower_y));
        return p;
    }

    /// No ray of a camera's block that meets the rectangle is farther from the middle than
    /// half_extent and a block.
    HWY_INLINE Laterals find_laterals(const Vertices& v, const Places& p) const {
        Laterals s;
        s.size = zero();
        for (int k = 0; k < 3; ++k) {
            s.x[k] = neg_mul_add(p.middle_x, v.z[k], v.x[k]);
            s.y[k] = neg_mul_add(p.middle_y, v.z[k], v.y[k]);
            s.size = max(s.size, abs(s.x[k]) + abs(s.y[k]));
        }
        const FloatVec farthest =
            kOnGrid ? p.half_extent + splat(frame_.block_extent) : p.half_extent;
        s.reach = mul_add(farthest, v.z_size, s.size);
        s.error = mul_add(splat(kLateralError), s.size,
                          mul_add(splat(kShearError * frame_.reach), v.z_size, v.leaf_error));
        return s;
    }

    HWY_INLINE PlaneSet find_planes(const Vertices& v, const Places& p, const Laterals& s) const {
        PlaneSet planes;
        const auto edge = [&](int k, int i, int j) HWY_ATTR {
            planes.a[k] = mul_sub(s.y[i], v.z[j], v.z[i] * s.y[j]);
            planes.b[k] = mul_sub(v.z[i], s.x[j], s.x[i] * v.z[j]);
            planes.c[k] = mul_sub(s.x[i], s.y[j], s.y[i] * s.x[j]);
        };
        edge(0, 1, 2);
        edge(1, 2, 0);
        edge(2, 0, 1);
        FloatVec slope = zero();
        for (int k = 0; k < 3; ++k) slope = max(slope, abs(planes.a[k]) + abs(planes.b[k]));
        const FloatVec rounding = splat(kEdgeRounding) * s.size *
                                  mul_add(splat(kShearRounding * frame_.reach), v.z_size, s.reach);
        planes.bound = mul_add(splat(kRayError * frame_.ray_error), slope,
                               mul_add(splat(2.0f) * s.error, s.reach + s.error, rounding));
        plane_normal(s.x, s.y, v.z, planes.normal);
        planes.det = mul_add(s.x[0], planes.normal[0],
                             mul_add(s.y[0], planes.normal[1], v.z[0] * planes.normal[2]));
        // Of rays in the rectangle, whether or not a block reaches farther.
        const FloatVec hit_reach = mul_add(p.half_extent, v.z_size, s.size + s.error);
        const FloatVec volume_error = mul_add(splat(kVolumeExtentError * frame_.row_size[2]),
                                              v.extent, splat(kVolumeRounding) * v.z_size);
        planes.det_error = hit_reach * mul_add(hit_reach, volume_error,
                                               splat(kVolumeError) * (s.error * v.z_size));
        return planes;
    }

    /// Where the sign of det is certain. Elsewhere a hit may have edge functions of either sign:
    /// they add up to det / z, with z no nearer than a vertex, so that where all vertices are well
    /// in front of the origin a larger bound covers both signs. Where they are not, and where
    /// something overflows, nothing is known of the triangle, and the rule is asked for every ray.
    HWY_INLINE Mask orient(const Places& p, PlaneSet& planes) const {
        const FloatVec size = abs(planes.det);
        const Mask oriented = size > planes.det_error;
        const FloatVec either_sign = splat(kEitherSign) * planes.det_error * p.largest_q;
        planes.bound = select(oriented, planes.bound, planes.bound + either_sign);
        const Mask usable = (oriented | p.in_front) & (planes.bound < splat(1e28f));
        const Mask known = usable & (size < splat(1e34f));
        if (HWY_LIKELY(all(known))) return oriented;
        planes.bound = select(known, planes.bound, splat(1e35f));
        planes.det = zero_unless(known, planes.det);
        for (int k = 0; k < 3; ++k) {
            planes.a[k] = zero_unless(known, planes.a[k]);
            planes.b[k] = zero_unless(known, planes.b[k]);
            planes.c[k] = zero_unless(known, planes.c[k]);
            planes.normal[k] = zero_unless(known, planes.normal[k]);
        }
        return oriented & known;
    }

    HWY_INLINE void store_edges(const Places& p, const PlaneSet& planes, FloatVec sign,
                                Setup& setup, std::size_t l) const {
        store(planes.bound, setup.bound + l);
        const FloatVec most_bound = splat(kLosingBound) * planes.bound;
        for (int k = 0; k < 3; ++k) {
            const FloatVec a = planes.a[k] ^ sign;
            const FloatVec b = planes.b[k] ^ sign;
            const FloatVec c =
                neg_mul_add(a, p.middle_x, neg_mul_add(b, p.middle_y, planes.c[k] ^ sign));
            store(a, setup.a[k] + l);
            store(b, setup.b[k] + l);
            store(c, setup.c[k] + l);
            if constexpr (!kOnGrid) store(c + most_bound, setup.most_c[k] + l);
        }
    }

    /// 1/z is that of the plane through the projected vertices. For a hit of the rule the mean of
    /// these under its weights is a point of that plane that is no farther than the error of a
    /// vertex from the ray; so 1/z is off by gradient * error of itself, which is certainly less
    /// than a quarter where |det| is more than kKnownVolume times its error. Elsewhere nothing is
    /// known of 1/z.
    HWY_INLINE void store_depth(const Vertices& v, const Places& p, const Laterals& s,
                                const PlaneSet& planes, FloatVec sign, Mask oriented, Setup& setup,
                                std::size_t l) const {
        const FloatVec det = abs(planes.det);
        const Mask has_depth = oriented & (det > splat(kKnownVolume) * planes.det_error);
        const FloatVec scale = splat(1.0f) / max(det, splat(1e-30f));
        const auto known = [has_depth](FloatVec value)
                               HWY_ATTR { return zero_unless(has_depth, value); };
        const FloatVec signed_scale = known(scale | sign);
        const FloatVec depth_a = planes.normal[0] * signed_scale;
        const FloatVec depth_b = planes.normal[1] * signed_scale;
        const FloatVec in_middle = planes.normal[2] * signed_scale;
        const FloatVec depth_c =
            neg_mul_add(depth_a, p.middle_x, neg_mul_add(depth_b, p.middle_y, in_middle));
        store(depth_a, setup.depth_a + l);
        store(depth_b, setup.depth_b + l);
        store(depth_c, setup.depth_c + l);
        const FloatVec gradient = abs(depth_a) + abs(depth_b);
        const FloatVec plane_error = mul_add(splat(kPlaneError), s.size, s.error);
        const FloatVec steep = splat(kSteepError) * plane_error * gradient;
        const RuleDepth rule =
            DepthBounds<kOnGrid>(frame_).find({v.x, v.y, v.z, s.x, s.y, v.z_least, v.z_most,
                                               v.z_size, s.size, v.extent, p.half_extent, scale},
                                              p.in_front & has_depth);
        FloatVec c0 = splat(kGradientRounding + kRayError * frame_.ray_error) * gradient;
        FloatVec c1 = splat(kReciprocalRounding) + rule.by_q + steep;
#if !HWY_NATIVE_FMA
        // Without fused operations the normal is off by 2 u of its parts' products.
        const FloatVec relative_size = splat(kUnfusedNormal) * (s.size * scale);
        const FloatVec sum_error = relative_size * mul_add(v.z_size, p.half_extent, s.size);
        const FloatVec det_error = relative_size * (s.size * v.z_size);
        c0 = c0 + sum_error;
        c1 = c1 + det_error;
#endif
        c0 = select(has_depth, c0, splat(1e35f));
        c1 = known(c1);
        if constexpr (kOnGrid) {
            // A ray that the rule may find to hit the triangle lies in its rectangle.
            const FloatVec most_q = mul_add(gradient, p.half_extent, abs(in_middle));
            const FloatVec most = mul_add(most_q, mul_add(most_q, rule.by_q2, c1), c0);
            const Mask is_far = most_q * rule.by_q2 <= splat(kFarDepth);
            const FloatVec error = select(is_far, most * splat(1.0001f), splat(1e35f));
            store(error, setup.error + l);
        } else {
            const FloatVec nearest = nearest_q(v.z_least - v.z_error - rule.z);
            store(nearest, setup.q + l);
            store(c0, setup.c0 + l);
            store(c1, setup.c1 + l);
            store(rule.by_q2, setup.c2 + l);
            const FloatVec most = mul_add(nearest, mul_add(nearest, rule.by_q2, c1), c0);
            const FloatVec rounded =
                mul_add(splat(kLosingGradient), gradient, splat(1 + 0x1p-18f) * most);
            store(depth_c + rounded, setup.most_q + l);
        }
    }

    /// a b - c d. Where there are fused operations, 2^-23 of itself off.
    static HWY_INLINE FloatVec difference_of_two_products(FloatVec a, FloatVec b, FloatVec c,
                                                          FloatVec d) {
        const FloatVec right = c * d;
#if HWY_NATIVE_FMA
        return mul_sub(a, b, right) + neg_mul_add(c, d, right);
#else
        return mul_sub(a, b, right);
#endif
    }

    /// The normal of the planes through triangles.
    static HWY_INLINE void plane_normal(const FloatVec x[3], const FloatVec y[3],
                                        const FloatVec z[3], FloatVec normal[3]) {
        const FloatVec p[3] = {x[1] - x[0], y[1] - y[0], z[1] - z[0]};
        const FloatVec q[3] = {x[2] - x[0], y[2] - y[0], z[2] - z[0]};
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
