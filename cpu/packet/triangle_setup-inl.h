// Sets up the triangles of a leaf in the plane of a packet, with a bound of every error, which
// docs/design/arithmetic.md, "Packets", derives.
#if defined(MORPHRAY_CPU_PACKET_TRIANGLE_SETUP_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_PACKET_TRIANGLE_SETUP_INL_H
#undef MORPHRAY_CPU_PACKET_TRIANGLE_SETUP_INL_H
#else
#define MORPHRAY_CPU_PACKET_TRIANGLE_SETUP_INL_H
#endif

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "common/interop/packet_bounds.h"
#include "cpu/packet/packet_plane-inl.h"
#include "cpu/packet/packets.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu::HWY_NAMESPACE {

// ---- Pixels

/// The columns (or rows) of pixels from `begin` to `end` whose middles lie within `margin` of
/// [lower, upper]; none if first > last. The middle of pixel k is at k - 31.5.
struct PixelRange {
    FloatVec first, last;

    HWY_INLINE PixelRange(FloatVec lower, FloatVec upper, float margin, int begin, int end) {
        constexpr float kMiddle = 0.5f * kCameraSide - 0.5f;
        first = max(hn::Ceil(lower + splat(kMiddle - margin)), splat(static_cast<float>(begin)));
        last = min(hn::Floor(upper + splat(kMiddle + margin)), splat(static_cast<float>(end)));
    }

    HWY_INLINE Mask any() const { return first <= last; }
    /// The columns (or rows) of blocks of these pixels, as bits.
    HWY_INLINE UintVec blocks() const {
        const UintVec below = hn::Shl(splat(1u), block(first));
        const UintVec up_to = hn::Shl(splat(2u), block(last));
        return zero_unless(uint_mask(any()), up_to - below);
    }

    /// The number of columns (or rows) of blocks, less one.
    HWY_INLINE UintVec more_blocks() const { return block(last) - block(first); }

    /// The first pixel, and the last one 8 bits above it, if there are any.
    HWY_INLINE UintVec pixels() const {
        const auto number = [](FloatVec pixel) HWY_ATTR {
            return as_uint(hn::ConvertTo(kInts, pixel)) & splat(kCameraSide - 1);
        };
        return number(first) | shift_left<8>(number(last));
    }

private:
    static HWY_INLINE UintVec block(FloatVec pixel) {
        static_assert(kBlockSide == 4);
        // Without pixels it still must be a valid shift count.
        return shift_right<2>(as_uint(hn::ConvertTo(kInts, pixel))) & splat(kGridSide - 1);
    }
};

// ---- Vertices

/// Returns the triangles of a leaf whose vertices are all finite, as bits.
inline std::uint32_t finite_triangles(const Leaf& leaf) {
    std::uint32_t finite = 0;
    for (std::uint32_t i = 0; i < std::size(leaf.vertex); ++i) {
        const std::uint32_t local = leaf.vertex[i].corners;
        const auto x = [&](std::uint32_t k) { return leaf.vertex[corner(local, k)].x; };
        finite |= (finite_coordinates(x(0), x(1), x(2)) ? 1u : 0u) << i;
    }
    return finite;
}

/// A leaf's vertices in a packet's projection.
struct alignas(64) ProjectedVertices {
    PerVertex<float> x, y, z;
    /// The largest coordinate relative to the leaf's first vertex, in scene space.
    PerVertex<float> size;
    /// The local vertex indices of the leaf's triangles, packed.
    PerTriangle<std::uint32_t> indices;
    /// The largest coordinate of the first vertex relative to the origin.
    float distance;
};

/// Projects the vertices of a leaf. The first vertex is the first finite one, where others that are
/// not finite are put. Returns whether all vertices are finite.
HWY_INLINE bool project_vertices(const PacketFrame& frame, const Leaf& leaf,
                                 ProjectedVertices& projected) {
    const LeafVertex* first = leaf.vertex;
    while (first->x > kSceneExtent && first + 1 != std::end(leaf.vertex)) ++first;
    const LeafVertex& v0 = *first;
    const double p[3] = {double{v0.x} - frame.org.x, double{v0.y} - frame.org.y,
                         double{v0.z} - frame.org.z};
    projected.distance =
        static_cast<float>(std::max({std::abs(p[0]), std::abs(p[1]), std::abs(p[2])}));
    float h[3];
    for (int k = 0; k < 3; ++k) {
        h[k] = static_cast<float>(frame.rows[k][0] * p[0] + frame.rows[k][1] * p[1] +
                                  frame.rows[k][2] * p[2]);
    }
    float* const out[3] = {projected.x, projected.y, projected.z};
    bool all_finite = true;
    for (std::size_t l = 0; l < std::size(leaf.vertex); l += kLanes) {
        FloatVec x, y, z, w;
        hn::LoadInterleaved4(kFloats, &leaf.vertex[l].x, x, y, z, w);
        store(as_uint(w), projected.indices + l);
        const Mask finite = x <= splat(kSceneExtent);
        all_finite &= all(finite);
        x = zero_unless(finite, x - splat(v0.x));
        y = zero_unless(finite, y - splat(v0.y));
        z = zero_unless(finite, z - splat(v0.z));
        store(max3(abs(x), abs(y), abs(z)), projected.size + l);
        for (int k = 0; k < 3; ++k) {
            const float* row = frame.rows_f[k];
            const FloatVec sum =
                mul_add(splat(row[0]), x, mul_add(splat(row[1]), y, splat(row[2]) * z));
            store(sum + splat(h[k]), out[k] + l);
        }
    }
    return all_finite;
}

// ---- The results of TriangleSetup's steps, a triangle a lane

/// Vertices in the packet's projection.
struct TriangleVertices {
    FloatVec x[3], y[3], z[3];
    /// The largest ProjectedVertices::size.
    FloatVec extent;
    /// The part of |x - X z| + |y - Y z|'s error that grows with the extent and the distance, for
    /// any ray (X, Y); the rule's displacement included.
    FloatVec leaf_error;
    FloatVec z_least, z_most, z_size, z_error;
};

/// Rectangles in the plane, and the section of each that lies in the packet.
struct TriangleRectangles {
    FloatVec lower_x, upper_x, lower_y, upper_y;
    FloatVec middle_x, middle_y;
    /// How far |x| + |y| of a ray in the section may be from the middle.
    FloatVec half_extent;
    /// Where all vertices are well in front of the origin, and the largest 1 / z there.
    Mask in_front;
    FloatVec largest_q;
    Mask meets;
};

/// Vertices as the ray in the middle of the triangle's section sees them: x - middle_x z.
struct TriangleLaterals {
    FloatVec x[3], y[3];
    /// The largest |x| + |y|: of the ray in the middle, and of any ray of the section.
    FloatVec size, reach;
    /// How far |x| + |y| may be from that of the rule's displaced vertices.
    FloatVec error;
};

/// The planes through the origin and an edge, the triangle's own plane, and `det`, 6 times the
/// volume that triangle and origin span, with its sign.
struct TrianglePlaneSet {
    FloatVec a[3], b[3], c[3];
    FloatVec bound, normal[3], det;
    /// The sign bit of det, and where that is certain.
    FloatVec sign;
    Mask oriented;
    /// How far det may be from that of a hit of the rule: where |det| is more, its sign is that of
    /// the edge functions inside.
    FloatVec det_error;
};

// ---- Set-up triangles

/// The plane of 1/z among those of a set-up triangle; the others are edge functions.
inline constexpr int kDepthPlane = 3;

/// Sixteen triangles of a leaf, set up: planes a[k] x + b[k] y + c[k] over the packet's plane. Edge
/// functions are positive inside, off by at most `bound`. Those of unoriented triangles may be
/// positive or negative inside, and nothing is known of their 1/z.
struct alignas(64) SetUpTriangles {
    PerTriangle<float> a[4], b[4], c[4];
    PerTriangle<float> bound;
};

/// Triangles for a camera packet: 1/z is off by at most `error`.
struct CameraTriangles : SetUpTriangles {
    PerTriangle<float> error;
    /// The columns and rows of blocks that each meets, as bits.
    PerTriangle<std::uint32_t> columns, rows;
    /// The triangles, as bits, that meet at most six blocks, in at most four columns and rows.
    std::uint32_t few;
    std::uint32_t unoriented;
};

/// Triangles for a light packet: q = 1/z is off by at most c0 + q (c1 + q c2). No hit has a larger
/// 1/z than `q`, and none lies outside the rectangle.
struct LightTriangles : SetUpTriangles {
    PerTriangle<float> c0, c1, c2, q;
    Rectangles rectangles;
    /// c plus kMissBound * bound, and that of 1/z plus the largest error (certainly_misses).
    PerTriangle<float> most_c[4];
    /// As bits. Triangles with a vertex `behind`, not in front of the origin, have the whole plane.
    std::uint32_t unoriented, behind;
};

/// A set-up triangle in registers, for all its (triangle, block) items.
struct Planes {
    HWY_INLINE Planes(const SetUpTriangles& triangles, std::uint32_t i)
        : Planes(triangles, i, triangles.c) {}
    /// With these constants in place of c.
    HWY_INLINE Planes(const SetUpTriangles& triangles, std::uint32_t i,
                      const PerTriangle<float> (&constants)[4])
        : bound(splat(triangles.bound[i])) {
        for (int k = 0; k < 4; ++k) {
            a[k] = splat(triangles.a[k][i]);
            b[k] = splat(triangles.b[k][i]);
            c[k] = splat(constants[k][i]);
        }
    }

    /// The least edge function at as many rays (x, y) as there are lanes.
    HWY_INLINE FloatVec least_edge(FloatVec x, FloatVec y) const {
        return min3(at(0, x, y), at(1, x, y), at(2, x, y));
    }
    /// The rays that may hit an unoriented triangle: rays of which no two edge functions beyond
    /// the bound have opposite signs.
    HWY_INLINE Mask may_be_inside(FloatVec x, FloatVec y) const {
        const FloatVec u = at(0, x, y), v = at(1, x, y), w = at(2, x, y);
        return !((min3(u, v, w) < -bound) & (max3(u, v, w) > bound));
    }
    HWY_INLINE FloatVec depth(FloatVec x, FloatVec y) const { return at(kDepthPlane, x, y); }

    FloatVec a[4], b[4], c[4], bound;

private:
    HWY_INLINE FloatVec at(int k, FloatVec x, FloatVec y) const {
        return mul_add(a[k], x, mul_add(b[k], y, c[k]));
    }
};

// ---- Depths

/// 1/z of the planes through triangles, q = a x + b y + c, and its error: a hit of the rule at a
/// ray (x, y) has 1/z within c0 + q (c1 + q c2) of it, if (q + error) c2 <= kFarDepth.
struct DepthPlanes {
    FloatVec a, b, c;
    FloatVec c0, c1, c2;
    /// |a| + |b|, and the largest |q| in the triangle's section of the packet.
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

    /// usable: where the volume is large enough for 1/z to be known. What is relative to q is
    /// `slope`, what is in z `shift`. q also rounds by kGradientRounding gradient +
    /// kReciprocalRounding q, and a ray that is ray_error off its place adds ray_error gradient.
    HWY_INLINE DepthPlanes find(const TriangleVertices& v, const TriangleRectangles& p,
                                const TriangleLaterals& s, const TrianglePlaneSet& planes,
                                Mask usable) const {
        const FloatVec scale = splat(1.0f) / max(abs(planes.det), splat(kLeastVolume));
        const FloatVec signed_scale = zero_unless(usable, scale | planes.sign);
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
        out.nearer = mul_add(splat(kSlantExtent * frame_.row_size[2] + shift_by_extent_), v.extent,
                             splat(slant_ * frame_.row_size[2] + shift_));
        out.gradient = sizes.gradient;
        out.most_q = mul_add(sizes.gradient, p.half_extent, abs(in_middle));
        return out;
    }

private:
    /// Magnitudes of the plane q = a x + b y + c: |a| + |b|; the sum over the projection's rows of
    /// a coefficient times the row's size; a bound of the sum of |N|'s components, where N is the
    /// plane's normal in scene space with N.p = 1.
    struct Sizes {
        FloatVec gradient, rows, normal;
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

    /// kSteepError pays for the second order.
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
    HWY_INLINE FloatVec add_unfused(const TriangleVertices& v, const TriangleRectangles& p,
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
    float shear_, shift_by_extent_, shift_, slant_, vertex_;
};

// ---- Set-up

/// a b - c d, off by 2^-23 of itself where there are fused operations.
HWY_INLINE FloatVec difference_of_two_products(FloatVec a, FloatVec b, FloatVec c, FloatVec d) {
    const FloatVec right = c * d;
    const FloatVec difference = mul_sub(a, b, right);
    return HWY_NATIVE_FMA ? difference + neg_mul_add(c, d, right) : difference;
}

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

/// Sets up triangles. lab/proofs/packet_*.g check the bounds; their constants are in
/// common/interop/packet_bounds.h. kOnGrid: for a camera packet, whose rays are near the middles of
/// pixels.
template <bool kOnGrid>
class TriangleSetup {
public:
    using Frame = std::conditional_t<kOnGrid, CameraFrame, PacketFrame>;
    using Triangles = std::conditional_t<kOnGrid, CameraTriangles, LightTriangles>;

    /// pixels: the pixels of a camera packet that count. Triangles that cover the middle of none
    /// are left out.
    explicit TriangleSetup(const Frame& frame,
                           const PixelRectangle& pixels = {0, kCameraSide - 1, 0, kCameraSide - 1})
        : frame_(frame),
          pixels_(pixels),
          row_sizes_(frame.row_size[0] + frame.row_size[1] + 2 * frame.reach * frame.row_size[2]) {}

    /// Sets up the triangles of a leaf. Returns those that may concern a ray of the packet, as
    /// bits.
    std::uint32_t run(const Leaf& leaf, Triangles& out) const {
        ProjectedVertices projected;
        const bool all_finite = project_vertices(frame_, leaf, projected);
        const FloatVec far_error =
            splat(row_sizes_ * (kDistanceError * projected.distance + kGridError) + kPlaneFloor);
        const DepthBounds depths(frame_, projected.distance);
        std::uint32_t alive = 0;
        out.unoriented = 0;
        if constexpr (kOnGrid) out.few = 0;
        if constexpr (!kOnGrid) out.behind = 0;
        const std::uint32_t count = corner_triangle_count(leaf.vertex[0].corners);
        for (std::size_t l = 0; l < (kOnGrid ? count : kMaxLanes); l += kLanes) {
            const TriangleVertices v = find_vertices(projected, far_error, l);
            const TriangleRectangles places = find_rectangles(v, out, l);
            if (kOnGrid && none(places.meets)) continue;
            const TriangleLaterals laterals = find_laterals(v, places);
            TrianglePlaneSet planes;
            find_edges(v, laterals, planes);
            find_volume(v, places, laterals, planes);
            planes.sign = planes.det & splat(-0.0f);
            out.unoriented |= orient(places, planes) << l;
            if constexpr (!kOnGrid) out.behind |= bits_of(!places.in_front) << l;
            store_edges(places, planes, out, l);
            store_depth(depths, v, places, laterals, planes, out, l);
            alive |= bits_of(places.meets) << l;
        }
        alive &= (1u << count) - 1;
        if (HWY_UNLIKELY(!all_finite)) alive &= finite_triangles(leaf);
        return alive;
    }

private:
    /// far_error: the part of leaf_error that does not depend on the extent. z is off by at most
    /// leaf_error and kDepthError of itself (lab/proofs/packet_vertices.g).
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

    /// A ray through the triangle lies between x / z of its displaced vertices where all z are
    /// positive (in_front): kQuotientError of x / z and `margin` cover all errors
    /// (lab/proofs/packet_rectangles.g). Other triangles have the whole plane.
    HWY_INLINE TriangleRectangles find_rectangles(const TriangleVertices& v, Triangles& out,
                                                  std::size_t l) const {
        const FloatVec least = splat(kLeastFrontZ);
        const FloatVec near =
            mul_add(splat(kFrontDepth), v.z_size, splat(kFrontError) * v.leaf_error);
        TriangleRectangles p;
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

    /// Stores the rectangles, and finds the section of each in the packet.
    HWY_INLINE void cut_to_packet(TriangleRectangles& p, Triangles& out, std::size_t l) const {
        const FloatVec cut_lower_x = max(p.lower_x, splat(frame_.lower_x));
        const FloatVec cut_upper_x = min(p.upper_x, splat(frame_.upper_x));
        const FloatVec cut_lower_y = max(p.lower_y, splat(frame_.lower_y));
        const FloatVec cut_upper_y = min(p.upper_y, splat(frame_.upper_y));
        if constexpr (kOnGrid) {
            // Most small triangles cover no pixel's middle at all.
            const PixelRange pixels_x(p.lower_x, p.upper_x, 0, pixels_.first_x, pixels_.last_x);
            const PixelRange pixels_y(p.lower_y, p.upper_y, 0, pixels_.first_y, pixels_.last_y);
            store(pixels_x.blocks(), out.columns + l);
            store(pixels_y.blocks(), out.rows + l);
            const UintVec more = pixels_x.more_blocks() + pixels_y.more_blocks();
            out.few |= bits_of(float_mask(as_int(more) < splat(std::int32_t{4}))) << l;
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

    /// Errors are relative to the distance from the ray in the middle. A ray of a camera's block
    /// that meets the rectangle is no farther from there than half_extent and a block.
    HWY_INLINE TriangleLaterals find_laterals(const TriangleVertices& v,
                                              const TriangleRectangles& p) const {
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

    /// Edge function k is l_i x l_j = a X + b Y + c, where l is a vertex as a ray sees it. Where
    /// all are above `bound`, or all below its negative, the rule finds the ray inside; where two
    /// beyond it have opposite signs, outside (lab/proofs/packet_edges.g).
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

    /// A hit's edge functions add up to det / z with z > 0, so inside they have det's sign.
    /// hit_reach is an upper bound of |l| + error for rays of the rectangle
    /// (lab/proofs/packet_volume.g).
    HWY_INLINE void find_volume(const TriangleVertices& v, const TriangleRectangles& p,
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

    /// Sets `oriented`. Returns the unoriented triangles, as bits. Without an orientation `bound`
    /// grows to cover both signs where all vertices are in front of the origin. Where they are not,
    /// no single sign says outside, and nothing is known of 1/z: these triangles are unoriented.
    /// Where a value may overflow, bound = kUnknown makes all rays uncertain.
    HWY_INLINE std::uint32_t orient(const TriangleRectangles& p, TrianglePlaneSet& planes) const {
        const FloatVec size = abs(planes.det);
        const FloatVec own_bound = planes.bound;
        planes.oriented = size > planes.det_error;
        const FloatVec either_sign = splat(kEitherSign) * planes.det_error * p.largest_q;
        planes.bound = select(planes.oriented, planes.bound, planes.bound + either_sign);
        const Mask usable = (planes.oriented | p.in_front) & (planes.bound < splat(kMostBound));
        const Mask is_moderate = size < splat(kMostVolume);
        const Mask known = usable & is_moderate;
        if (HWY_LIKELY(all(known))) return 0;
        const Mask has_edges = known | ((own_bound < splat(kMostBound)) & is_moderate);
        planes.bound = select(known, planes.bound, select(has_edges, own_bound, splat(kUnknown)));
        planes.det = zero_unless(known, planes.det);
        for (int k = 0; k < 3; ++k) {
            planes.a[k] = zero_unless(has_edges, planes.a[k]);
            planes.b[k] = zero_unless(has_edges, planes.b[k]);
            planes.c[k] = zero_unless(has_edges, planes.c[k]);
            planes.normal[k] = zero_unless(known, planes.normal[k]);
        }
        planes.oriented = planes.oriented & known;
        return bits_of(!known);
    }

    /// Stores the edge functions, positive inside and moved from the middle to the plane's origin.
    HWY_INLINE void store_edges(const TriangleRectangles& p, const TrianglePlaneSet& planes,
                                Triangles& out, std::size_t l) const {
        store(planes.bound, out.bound + l);
        const FloatVec most_bound = splat(kMissBound) * planes.bound;
        for (int k = 0; k < 3; ++k) {
            const FloatVec a = planes.a[k] ^ planes.sign;
            const FloatVec b = planes.b[k] ^ planes.sign;
            const FloatVec c =
                neg_mul_add(a, p.middle_x, neg_mul_add(b, p.middle_y, planes.c[k] ^ planes.sign));
            store(a, out.a[k] + l);
            store(b, out.b[k] + l);
            store(c, out.c[k] + l);
            if constexpr (!kOnGrid) store(c + most_bound, out.most_c[k] + l);
        }
    }

    /// Stores 1/z and its error: a camera packet's for the whole rectangle, a light packet's by q,
    /// and the largest one in most_c.
    HWY_INLINE void store_depth(const DepthBounds& bounds, const TriangleVertices& v,
                                const TriangleRectangles& p, const TriangleLaterals& s,
                                const TrianglePlaneSet& planes, Triangles& out,
                                std::size_t l) const {
        // Beyond this, what underflows in the plane and in det is far below their rounding.
        const FloatVec least_det = splat(kLeastSlantVolume) * (splat(1.0f) + s.size + v.z_size);
        const Mask usable = planes.oriented & (abs(planes.det) > least_det);
        const DepthPlanes depth = bounds.find(v, p, s, planes, usable);
        store(depth.a, out.a[kDepthPlane] + l);
        store(depth.b, out.b[kDepthPlane] + l);
        store(depth.c, out.c[kDepthPlane] + l);
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
            store(depth.c + rounded, out.most_c[kDepthPlane] + l);
        }
    }

    const Frame& frame_;
    PixelRectangle pixels_;
    /// The most by which a step of 1 on each axis of scene space changes |x - X z| + |y - Y z|.
    float row_sizes_;
};

}  // namespace mray::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per target
