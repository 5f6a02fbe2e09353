// The triangles of a leaf in the projection of a packet: their vertices, and what a set-up triangle
// holds.

#if defined(MORPHRAY_CPU_PACKET_PACKET_TRIANGLES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_PACKET_PACKET_TRIANGLES_INL_H
#undef MORPHRAY_CPU_PACKET_PACKET_TRIANGLES_INL_H
#else
#define MORPHRAY_CPU_PACKET_PACKET_TRIANGLES_INL_H
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "common/interop/bvh_layout.h"
#include "cpu/packet/camera/camera_packet_blocks-inl.h"
#include "cpu/packet/packet_frame-inl.h"
#include "cpu/simd/hit_rule-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {

/// Returns the triangles of a leaf whose vertices are all finite, as bits.
inline std::uint32_t finite_triangles(const Leaf& leaf) {
    std::uint32_t finite = 0;
    for (std::uint32_t i = 0; i < kLeafTriangles; ++i) {
        float largest = -kSceneExtent;
        for (std::uint32_t k = 0; k < 3; ++k)
            largest = std::max(largest, leaf.vertex[corner(leaf.vertex[i].corners, k)].x);
        finite |= (largest <= kSceneExtent ? 1u : 0u) << i;
    }
    return finite;
}

/// A leaf's vertices in a packet's projection. TriangleSetup bounds their errors.
struct alignas(64) ProjectedVertices {
    float x[kLeafVertices], y[kLeafVertices], z[kLeafVertices];
    /// The largest coordinate relative to the leaf's first vertex, in scene space.
    float size[kLeafVertices];
    /// The local vertex indices of the leaf's triangles, packed.
    std::uint32_t indices[kLeafVertices];
    /// The largest coordinate of the first vertex relative to the origin.
    float distance;
};

/// Projects the vertices of a leaf. The first vertex is the first finite one; a vertex that is not
/// finite is put there. Returns whether all vertices are finite.
HWY_INLINE bool project_vertices(const PacketFrame& frame, const Leaf& leaf,
                                 ProjectedVertices& projected) {
    const LeafVertex* first = leaf.vertex;
    while (first->x > kSceneExtent && first != leaf.vertex + kLeafVertices - 1) ++first;
    const LeafVertex& v0 = *first;
    const double p[3] = {double{v0.x} - frame.org.x, double{v0.y} - frame.org.y,
                         double{v0.z} - frame.org.z};
    projected.distance =
        static_cast<float>(std::max(std::abs(p[0]), std::max(std::abs(p[1]), std::abs(p[2]))));
    float h[3];
    for (int k = 0; k < 3; ++k) {
        h[k] = static_cast<float>(frame.rows[k][0] * p[0] + frame.rows[k][1] * p[1] +
                                  frame.rows[k][2] * p[2]);
    }
    float* const out[3] = {projected.x, projected.y, projected.z};
    bool all_finite = true;
    for (std::size_t l = 0; l < kLeafVertices; l += kLanes) {
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

// ---- The results of TriangleSetup's steps, for as many triangles as there are lanes

/// Step 1: vertices in the packet's projection.
struct TriangleVertices {
    FloatVec x[3], y[3], z[3];
    /// The largest coordinate relative to the leaf's first vertex, in scene space.
    FloatVec extent;
    /// The part of |x - X z| + |y - Y z|'s error that grows with the extent and the distance, for
    /// any ray (X, Y); the rule's displacement included.
    FloatVec leaf_error;
    FloatVec z_least, z_most, z_size;
    FloatVec z_error;
};

/// Step 2: rectangles in the plane, and the part of each that lies in the packet.
struct TrianglePlaces {
    FloatVec lower_x, upper_x, lower_y, upper_y;
    FloatVec middle_x, middle_y;
    /// How far |x| + |y| of a ray in the part may be from the middle.
    FloatVec half_extent;
    /// Where all vertices are well in front of the origin, and the largest 1 / z there.
    Mask in_front;
    FloatVec largest_q;
    /// Where the rectangle meets the packet.
    Mask meets;
};

/// Step 3: vertices as the ray in the middle of the triangle's part sees them: x - middle_x z.
struct TriangleLaterals {
    FloatVec x[3], y[3];
    /// The largest |x| + |y|: of the ray in the middle, and of any ray of the part.
    FloatVec size, reach;
    /// How far |x| + |y| may be from that of the rule's displaced vertices.
    FloatVec error;
};

/// Step 4: the planes through the origin and an edge, the triangle's own plane, and `det`, which is
/// 6 times the volume that triangle and origin span, with its sign.
struct TrianglePlaneSet {
    FloatVec a[3], b[3], c[3];
    FloatVec bound;
    FloatVec normal[3];
    FloatVec det;
    /// How far det may be from that of a hit of the rule: where |det| is more, its sign is that of
    /// the edge functions inside.
    FloatVec det_error;
};

// ---- Set-up triangles

/// Sixteen triangles of a leaf, set up: edge functions a[k] x + b[k] y + c[k] of the packet's
/// plane, positive inside, off by at most `bound`; and 1/z = depth_a x + depth_b y + depth_c. Edge
/// functions of unoriented triangles may be positive or negative inside, and nothing is known of
/// their 1/z.
struct alignas(64) SetUpTriangles {
    float a[3][16], b[3][16], c[3][16];
    float depth_a[16], depth_b[16], depth_c[16];
    float bound[16];
};

/// Triangles for a camera packet: 1/z is off by at most `error`.
struct CameraTriangles : SetUpTriangles {
    float error[16];
    /// The triangles whose orientation is unknown, as bits.
    std::uint32_t unoriented;
    GridWindows windows;
};

/// Triangles for a light packet: q = 1/z is off by at most c0 + q (c1 + q c2). No hit has a larger
/// 1/z than `q`, and none lies outside the rectangle.
struct LightTriangles : SetUpTriangles {
    float c0[16], c1[16], c2[16], q[16];
    Rectangles rectangles;
    /// c plus kMissBound * bound, and depth_c plus the largest error (MissPlanes).
    float most_c[3][16], most_q[16];
    /// As bits. Triangles of which a vertex is `behind`, not in front of the origin, have the whole
    /// plane for a rectangle.
    std::uint32_t unoriented, behind;
};

/// A set-up triangle in registers, for all its (triangle, block) items.
struct Planes {
    HWY_INLINE Planes(const SetUpTriangles& triangles, std::uint32_t i)
        : a0(splat(triangles.a[0][i])),
          a1(splat(triangles.a[1][i])),
          a2(splat(triangles.a[2][i])),
          b0(splat(triangles.b[0][i])),
          b1(splat(triangles.b[1][i])),
          b2(splat(triangles.b[2][i])),
          c0(splat(triangles.c[0][i])),
          c1(splat(triangles.c[1][i])),
          c2(splat(triangles.c[2][i])),
          depth_a(splat(triangles.depth_a[i])),
          depth_b(splat(triangles.depth_b[i])),
          depth_c(splat(triangles.depth_c[i])),
          bound(splat(triangles.bound[i])) {}

    /// The least edge function at as many rays (x, y) as there are lanes.
    HWY_INLINE FloatVec least_edge(FloatVec x, FloatVec y) const {
        const EdgeValues e = edges(x, y);
        return min3(e.u, e.v, e.w);
    }
    /// The rays that may hit an unoriented triangle: those of which no two edge functions beyond
    /// the bound have opposite signs.
    HWY_INLINE Mask may_be_inside(FloatVec x, FloatVec y) const {
        const EdgeValues e = edges(x, y);
        return !((min3(e.u, e.v, e.w) < -bound) & (max3(e.u, e.v, e.w) > bound));
    }
    /// 1/z at these rays.
    HWY_INLINE FloatVec depth(FloatVec x, FloatVec y) const {
        return mul_add(depth_a, x, mul_add(depth_b, y, depth_c));
    }

    FloatVec a0, a1, a2, b0, b1, b2, c0, c1, c2;
    FloatVec depth_a, depth_b, depth_c;
    FloatVec bound;

private:
    struct EdgeValues {
        FloatVec u, v, w;
    };
    HWY_INLINE EdgeValues edges(FloatVec x, FloatVec y) const {
        return {mul_add(a0, x, mul_add(b0, y, c0)), mul_add(a1, x, mul_add(b1, y, c1)),
                mul_add(a2, x, mul_add(b2, y, c2))};
    }
};

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif
