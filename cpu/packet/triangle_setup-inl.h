// Sets up the triangles of a leaf in the plane of a packet, with a bound of every error.

#if defined(MORPHRAY_CPU_PACKET_TRIANGLE_SETUP_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_PACKET_TRIANGLE_SETUP_INL_H
#undef MORPHRAY_CPU_PACKET_TRIANGLE_SETUP_INL_H
#else
#define MORPHRAY_CPU_PACKET_TRIANGLE_SETUP_INL_H
#endif

#include <hwy/highway.h>

#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "common/interop/bvh_layout.h"
#include "common/interop/packet_bounds.h"
#include "cpu/packet/camera/camera_packet.h"
#include "cpu/packet/camera/camera_packet_blocks-inl.h"
#include "cpu/packet/depth_bounds-inl.h"
#include "cpu/packet/packet_frame-inl.h"
#include "cpu/packet/packet_triangles-inl.h"
#include "cpu/simd/hit_rule-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {

/// a b - c d, off by 2^-23 of itself where there are fused operations.
HWY_INLINE FloatVec difference_of_two_products(FloatVec a, FloatVec b, FloatVec c, FloatVec d) {
    const FloatVec right = c * d;
#if HWY_NATIVE_FMA
    return mul_sub(a, b, right) + neg_mul_add(c, d, right);
#else
    return mul_sub(a, b, right);
#endif
}

/// Sets the normals of the planes through triangles.
HWY_INLINE void plane_normal(const FloatVec x[3], const FloatVec y[3], const FloatVec z[3],
                             FloatVec normal[3]) {
    const FloatVec p[3] = {x[1] - x[0], y[1] - y[0], z[1] - z[0]};
    const FloatVec q[3] = {x[2] - x[0], y[2] - y[0], z[2] - z[0]};
    for (int k = 0; k < 3; ++k) {
        const int i = (k + 1) % 3;
        const int j = (k + 2) % 3;
        normal[k] = difference_of_two_products(p[i], q[j], p[j], q[i]);
    }
}

/// Sets up triangles in these steps, those of docs/design/arithmetic.md, "Packets", which derives
/// each bound; lab/proofs/packet_*.g check them. The constants are those of
/// common/interop/packet_bounds.h, in units of u = 2^-24. kOnGrid: for a camera packet, whose rays
/// are near the middles of pixels.
///
/// 1. find_vertices: x, y, z of the vertices (packet_vertices.g).
/// 2. find_places: the rectangle that a triangle is seen in (packet_rectangles.g).
/// 3. find_laterals: the vertices as the ray in the middle of that rectangle sees them, which keeps
///    errors relative to the distance from the ray (packet_vertices.g).
/// 4. find_edges: edge functions and `bound` (packet_edges.g).
/// 5. find_volume and orient: the sign of the edge functions inside (packet_volume.g).
/// 6. store_depth: 1/z and its error, by DepthBounds (packet_slant.g).
template <bool kOnGrid>
class TriangleSetup {
public:
    using Frame = std::conditional_t<kOnGrid, CameraFrame, PacketFrame>;
    using Triangles = std::conditional_t<kOnGrid, CameraTriangles, LightTriangles>;

    /// pixels: those of a camera packet that count. Triangles that cover the middle of none are
    /// left out.
    explicit TriangleSetup(const Frame& frame,
                           const PixelRectangle& pixels = {0, kCameraSide - 1, 0, kCameraSide - 1})
        : frame_(frame),
          pixels_(pixels),
          row_sizes_(frame.row_size[0] + frame.row_size[1] + 2 * frame.reach * frame.row_size[2]) {}

    /// Sets up the triangles of a leaf. Returns those that may concern a ray of the packet, as
    /// bits.
    std::uint32_t run(const Leaf& leaf, Triangles& out) const {
        bool all_finite = true;
        std::uint32_t alive = set_up(leaf, out, all_finite);
        alive &= (1u << corner_triangle_count(leaf.vertex[0].corners)) - 1;
        if (HWY_UNLIKELY(!all_finite)) alive &= finite_triangles(leaf);
        return alive;
    }

private:
    HWY_INLINE std::uint32_t set_up(const Leaf& leaf, Triangles& out, bool& all_finite) const {
        ProjectedVertices projected;
        all_finite = project_vertices(frame_, leaf, projected);
        const FloatVec far_error =
            splat(row_sizes_ * (kDistanceError * projected.distance + kGridError) + kPlaneFloor);
        const DepthBounds depths(frame_, projected.distance);
        std::uint32_t alive = 0;
        out.unoriented = 0;
        if constexpr (!kOnGrid) out.behind = 0;
        for (std::size_t l = 0; l < kLeafTriangles; l += kLanes) {
            const TriangleVertices v = find_vertices(projected, far_error, l);
            const TrianglePlaces places = find_places(v, out, l);
            if (kOnGrid && none(places.meets)) continue;
            const TriangleLaterals laterals = find_laterals(v, places);
            TrianglePlaneSet planes;
            find_edges(v, laterals, planes);
            find_volume(v, places, laterals, planes);
            const FloatVec sign = planes.det & splat(-0.0f);
            std::uint32_t unoriented = 0;
            const Mask oriented = orient(places, planes, unoriented);
            out.unoriented |= unoriented << l;
            if constexpr (!kOnGrid) out.behind |= bits_of(!places.in_front) << l;
            store_edges(places, planes, sign, out, l);
            store_depth(depths, v, places, laterals, planes, sign, oriented, out, l);
            alive |= bits_of(places.meets) << l;
        }
        return alive;
    }

    /// Step 1. The error of |x - X z| + |y - Y z| that grows with the extent and the distance is
    ///     leaf_error = row_sizes (kExtentError extent + kDistanceError distance + kGridError)
    ///                  + kPlaneFloor,
    /// where far_error has all but the first term. z is off by at most leaf_error and kDepthError
    /// of itself.
    HWY_INLINE TriangleVertices find_vertices(const ProjectedVertices& projected,
                                              FloatVec far_error, std::size_t l) const {
        TriangleVertices v;
        FloatVec size[3];
        const UintVec indices = load(projected.indices + l);
        gather_corners(projected.x, indices, v.x);
        gather_corners(projected.y, indices, v.y);
        gather_corners(projected.z, indices, v.z);
        gather_corners(projected.size, indices, size);
        v.extent = max3(size[0], size[1], size[2]);
        v.leaf_error = mul_add(splat(kExtentError * row_sizes_), v.extent, far_error);
        v.z_least = min3(v.z[0], v.z[1], v.z[2]);
        v.z_most = max3(v.z[0], v.z[1], v.z[2]);
        v.z_size = max(abs(v.z_least), abs(v.z_most));
        v.z_error = mul_add(splat(kDepthError), v.z_size, v.leaf_error);
        return v;
    }

    /// Step 2.
    /// 1. A ray through a triangle of the rule is a mean of its displaced vertices, so it lies
    ///    between their x / z where all z are positive (in_front).
    /// 2. A vertex's x / z is off by leaf_error / z, a ray by ray_error: kRectangleError times
    ///    both, with kRectangleRounding for sums with places in the packet, is `margin`.
    /// 3. The quotient and x round by kQuotientError of x / z.
    /// 4. A triangle that is not in front of the origin has the whole plane.
    HWY_INLINE TrianglePlaces find_places(const TriangleVertices& v, Triangles& out,
                                          std::size_t l) const {
        const FloatVec least = splat(kLeastFrontZ);
        const FloatVec near =
            mul_add(splat(kFrontDepth), v.z_size, splat(kFrontError) * v.leaf_error);
        TrianglePlaces p;
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
        const FloatVec all = splat(kWholePlane);
        const auto lower = [&](const FloatVec r[3]) HWY_ATTR {
            const FloatVec low = min3(r[0], r[1], r[2]);
            const FloatVec out_low = neg_mul_add(splat(kQuotientError), abs(low), low);
            return select(p.in_front, out_low - margin, -all);
        };
        const auto upper = [&](const FloatVec r[3]) HWY_ATTR {
            const FloatVec high = max3(r[0], r[1], r[2]);
            const FloatVec out_high = mul_add(splat(kQuotientError), abs(high), high);
            return select(p.in_front, out_high + margin, all);
        };
        p.lower_x = lower(rx);
        p.upper_x = upper(rx);
        p.lower_y = lower(ry);
        p.upper_y = upper(ry);
        p.meets = v.z_most + v.z_error > zero();
        cut_to_packet(p, out, l);
        return p;
    }

    /// Step 2, continued: stores the rectangles, and finds the part of each in the packet.
    HWY_INLINE void cut_to_packet(TrianglePlaces& p, Triangles& out, std::size_t l) const {
        const FloatVec cut_lower_x = max(p.lower_x, splat(frame_.lower_x));
        const FloatVec cut_upper_x = min(p.upper_x, splat(frame_.upper_x));
        const FloatVec cut_lower_y = max(p.lower_y, splat(frame_.lower_y));
        const FloatVec cut_upper_y = min(p.upper_y, splat(frame_.upper_y));
        if constexpr (kOnGrid) {
            // Most small triangles cover no pixel's middle at all.
            const PixelRange pixels_x(p.lower_x, p.upper_x, 0, pixels_.first_x, pixels_.last_x);
            const PixelRange pixels_y(p.lower_y, p.upper_y, 0, pixels_.first_y, pixels_.last_y);
            out.windows.set(l, pixels_x, pixels_y);
            p.meets = p.meets & (pixels_x.any() & pixels_y.any());
        } else {
            RectangleLanes(p.lower_x, p.upper_x, p.lower_y, p.upper_y).put(out.rectangles, l);
            p.meets = p.meets & ((cut_lower_x <= cut_upper_x) & (cut_lower_y <= cut_upper_y));
        }
        const FloatVec half = splat(0.5f);
        p.middle_x = half * (cut_lower_x + cut_upper_x);
        p.middle_y = half * (cut_lower_y + cut_upper_y);
        p.half_extent = half * (cut_upper_x - cut_lower_x + (cut_upper_y - cut_lower_y));
    }

    /// Step 3.
    ///     error = kLateralError size + kShearError reach z_size + leaf_error.
    /// A ray of a camera's block that meets the rectangle is no farther from the middle than
    /// half_extent and a block.
    HWY_INLINE TriangleLaterals find_laterals(const TriangleVertices& v,
                                              const TrianglePlaces& p) const {
        TriangleLaterals s;
        s.size = zero();
        for (int k = 0; k < 3; ++k) {
            s.x[k] = neg_mul_add(p.middle_x, v.z[k], v.x[k]);
            s.y[k] = neg_mul_add(p.middle_y, v.z[k], v.y[k]);
            s.size = max(s.size, abs(s.x[k]) + abs(s.y[k]));
        }
        FloatVec farthest = p.half_extent;
        if constexpr (kOnGrid) farthest = farthest + splat(frame_.block_extent);
        s.reach = mul_add(farthest, v.z_size, s.size);
        s.error = mul_add(splat(kLateralError), s.size,
                          mul_add(splat(kShearError * frame_.reach), v.z_size, v.leaf_error));
        return s;
    }

    /// Step 4. Edge function k is l_i x l_j = a X + b Y + c, where l is a vertex as a ray sees it.
    /// 1. Errors of both vertices change it by at most 2 error (reach + error).
    /// 2. Rounding adds kEdgeRounding size (reach + kShearRounding R z_size), R the frame's reach.
    /// 3. A ray that is ray_error off its place adds kRayError ray_error (|a| + |b|).
    /// Their sum is `bound`: where all edge functions are above it, or all below its negative, the
    /// rule finds the ray inside; where two beyond it have opposite signs, outside.
    HWY_INLINE void find_edges(const TriangleVertices& v, const TriangleLaterals& s,
                               TrianglePlaneSet& planes) const {
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
    }

    /// Step 5. A hit's edge functions add up to det / z with z > 0, so inside they have det's sign.
    /// L = hit_reach is an upper bound of |l| + error for rays of the rectangle:
    ///     det_error = L (L (kVolumeRounding z_size + kVolumeExtentError s_z extent)
    ///                    + kVolumeError error z_size).
    HWY_INLINE void find_volume(const TriangleVertices& v, const TrianglePlaces& p,
                                const TriangleLaterals& s, TrianglePlaneSet& planes) const {
        plane_normal(s.x, s.y, v.z, planes.normal);
        planes.det = mul_add(s.x[0], planes.normal[0],
                             mul_add(s.y[0], planes.normal[1], v.z[0] * planes.normal[2]));
        const FloatVec hit_reach = mul_add(p.half_extent, v.z_size, s.size + s.error);
        const FloatVec volume_error = mul_add(splat(kVolumeExtentError * frame_.row_size[2]),
                                              v.extent, splat(kVolumeRounding) * v.z_size);
        planes.det_error = hit_reach * mul_add(hit_reach, volume_error,
                                               splat(kVolumeError) * (s.error * v.z_size));
    }

    /// Step 5, continued. Returns where det's sign is certain.
    /// 1. Elsewhere a hit may have edge functions of either sign, whose magnitudes add up to at
    ///    most 2 det_error / z. No z is nearer than a vertex, so where all vertices are in front of
    ///    the origin, `bound` grows by kEitherSign det_error largest_q to cover both signs.
    /// 2. Where they are not, no single sign says outside, and nothing is known of 1/z: these
    ///    triangles are unoriented (bits), and have the bound of step 4.
    /// 3. Where a value may overflow, nothing is known at all: bound = kUnknown makes all rays
    ///    uncertain.
    HWY_INLINE Mask orient(const TrianglePlaces& p, TrianglePlaneSet& planes,
                           std::uint32_t& unoriented) const {
        const FloatVec size = abs(planes.det);
        const FloatVec own_bound = planes.bound;
        const Mask oriented = size > planes.det_error;
        const FloatVec either_sign = splat(kEitherSign) * planes.det_error * p.largest_q;
        planes.bound = select(oriented, planes.bound, planes.bound + either_sign);
        const Mask usable = (oriented | p.in_front) & (planes.bound < splat(kMostBound));
        const Mask is_moderate = size < splat(kMostVolume);
        const Mask known = usable & is_moderate;
        if (HWY_LIKELY(all(known))) return oriented;
        const Mask has_edges = known | ((own_bound < splat(kMostBound)) & is_moderate);
        unoriented = bits_of(!known);
        planes.bound = select(known, planes.bound, select(has_edges, own_bound, splat(kUnknown)));
        planes.det = zero_unless(known, planes.det);
        for (int k = 0; k < 3; ++k) {
            planes.a[k] = zero_unless(has_edges, planes.a[k]);
            planes.b[k] = zero_unless(has_edges, planes.b[k]);
            planes.c[k] = zero_unless(has_edges, planes.c[k]);
            planes.normal[k] = zero_unless(known, planes.normal[k]);
        }
        return oriented & known;
    }

    /// Stores the edge functions, positive inside and moved from the middle to the plane's origin.
    HWY_INLINE void store_edges(const TrianglePlaces& p, const TrianglePlaneSet& planes,
                                FloatVec sign, Triangles& out, std::size_t l) const {
        store(planes.bound, out.bound + l);
        const FloatVec most_bound = splat(kMissBound) * planes.bound;
        for (int k = 0; k < 3; ++k) {
            const FloatVec a = planes.a[k] ^ sign;
            const FloatVec b = planes.b[k] ^ sign;
            const FloatVec c =
                neg_mul_add(a, p.middle_x, neg_mul_add(b, p.middle_y, planes.c[k] ^ sign));
            store(a, out.a[k] + l);
            store(b, out.b[k] + l);
            store(c, out.c[k] + l);
            if constexpr (!kOnGrid) store(c + most_bound, out.most_c[k] + l);
        }
    }

    /// Stores 1/z and its error: a camera packet's for the whole rectangle, which holds every ray
    /// that the rule may find to hit; a light packet's by q, and the largest one in most_q
    /// (MissPlanes). Step 6.
    HWY_INLINE void store_depth(const DepthBounds& bounds, const TriangleVertices& v,
                                const TrianglePlaces& p, const TriangleLaterals& s,
                                const TrianglePlaneSet& planes, FloatVec sign, Mask oriented,
                                Triangles& out, std::size_t l) const {
        // Beyond this, what underflows in the plane and in det is far below their rounding.
        const FloatVec least_det = splat(kLeastSlantVolume) * (splat(1.0f) + s.size + v.z_size);
        const Mask usable = oriented & (abs(planes.det) > least_det);
        const DepthPlanes depth = bounds.find(v, p, s, planes, sign, usable);
        store(depth.a, out.depth_a + l);
        store(depth.b, out.depth_b + l);
        store(depth.c, out.depth_c + l);
        const FloatVec error = depth.error_at(depth.most_q);
        const FloatVec upper = depth.most_q + error;
        const Mask is_far = upper * depth.c2 <= splat(kFarDepth);
        if constexpr (kOnGrid) {
            store(select(is_far, error * splat(kCameraErrorFactor), splat(kUnknown)),
                  out.error + l);
        } else {
            const FloatVec by_vertices = nearest_q(v.z_least - v.z_error - depth.nearer);
            const FloatVec by_plane = upper * splat(kNearestByDepth);
            const FloatVec nearest =
                select(depth.known & is_far & (by_plane < by_vertices), by_plane, by_vertices);
            store(nearest, out.q + l);
            store(depth.c0, out.c0 + l);
            store(depth.c1, out.c1 + l);
            store(depth.c2, out.c2 + l);
            const FloatVec rounded = mul_add(splat(kMissGradient), depth.gradient,
                                             splat(kLightErrorFactor) * depth.error_at(nearest));
            store(depth.c + rounded, out.most_q + l);
        }
    }

    const Frame& frame_;
    PixelRectangle pixels_;
    /// How much |x - X z| + |y - Y z| grows by a step of 1 in each of x, y and z of scene space, at
    /// most.
    float row_sizes_;
};

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif
