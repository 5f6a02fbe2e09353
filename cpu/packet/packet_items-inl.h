// Triangles that have been set up against blocks of a packet: what the bounds say of single rays,
// and which pairs are worth a look at all.

#if defined(MORPHRAY_CPU_PACKET_PACKET_ITEMS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_PACKET_PACKET_ITEMS_INL_H
#undef MORPHRAY_CPU_PACKET_PACKET_ITEMS_INL_H
#else
#define MORPHRAY_CPU_PACKET_PACKET_ITEMS_INL_H
#endif

#include <hwy/highway.h>

#include <cstddef>
#include <cstdint>

#include "cpu/packet/packet.h"
#include "cpu/packet/triangle_setup-inl.h"
#include "cpu/simd/fast_hit_rule-inl.h"

HWY_BEFORE_NAMESPACE();
namespace morphray::cpu {
namespace HWY_NAMESPACE {

/// What a triangle's set-up is to each of its pairs with a block.
struct Planes {
    HWY_INLINE Planes(const Setup& setup, std::uint32_t i)
        : a0(splat(setup.a[0][i])),
          a1(splat(setup.a[1][i])),
          a2(splat(setup.a[2][i])),
          b0(splat(setup.b[0][i])),
          b1(splat(setup.b[1][i])),
          b2(splat(setup.b[2][i])),
          c0(splat(setup.c[0][i])),
          c1(splat(setup.c[1][i])),
          c2(splat(setup.c[2][i])),
          depth_a(splat(setup.depth_a[i])),
          depth_b(splat(setup.depth_b[i])),
          depth_c(splat(setup.depth_c[i])),
          bound(splat(setup.bound[i])) {}

    /// The least edge function and 1/z of as many rays (x, y) as there are lanes.
    HWY_INLINE FloatVec least_edge(FloatVec x, FloatVec y) const {
        const FloatVec u = mul_add(a0, x, mul_add(b0, y, c0));
        const FloatVec v = mul_add(a1, x, mul_add(b1, y, c1));
        const FloatVec w = mul_add(a2, x, mul_add(b2, y, c2));
        return min(u, min(v, w));
    }
    HWY_INLINE FloatVec depth(FloatVec x, FloatVec y) const {
        return mul_add(depth_a, x, mul_add(depth_b, y, depth_c));
    }

    FloatVec a0, a1, a2, b0, b1, b2, c0, c1, c2;
    FloatVec depth_a, depth_b, depth_c;
    FloatVec bound;
};

/// Likewise with a block of a point's packet.
struct PointPlanes : Planes {
    HWY_INLINE PointPlanes(const Setup& setup, std::uint32_t i)
        : Planes(setup, i),
          error0(splat(setup.c0[i])),
          error1(splat(setup.c1[i])),
          error2(splat(setup.c2[i])) {}

    FloatVec error0, error1, error2;
};

/// What the bounds say of a triangle and as many rays (x, y) as there are lanes: the least edge
/// function, and 1/z from q_lower to q_upper. Of a NaN, from an overflow, nothing is certain.
struct Position {
    HWY_INLINE Position(const PointPlanes& p, FloatVec x, FloatVec y) : least(p.least_edge(x, y)) {
        const FloatVec q = p.depth(x, y);
        const FloatVec error = mul_add(q, mul_add(q, p.error2, p.error1), p.error0);
        q_lower = q - error;
        q_upper = q + error;
        is_far = q * p.error2 <= splat(kFarDepth);
    }

    /// The rays that certainly hit the triangle, nearer than their best.
    HWY_INLINE Mask wins(const Planes& p, FloatVec best_upper) const {
        return (least > p.bound) & (q_lower > best_upper);
    }

    /// Those that certainly do not.
    HWY_INLINE Mask loses(const Planes& p, FloatVec best_lower) const {
        return (least < -p.bound) | (is_far & (q_upper < best_lower));
    }

    FloatVec least, q_lower, q_upper;
    /// So far that q_upper holds.
    Mask is_far;
};

/// The triangles of a leaf whose rectangle meets a block and that are near enough for it.
HWY_INLINE std::uint32_t triangles_at(const Packet& packet, const Setup& setup,
                                      std::uint32_t block) {
    const Rectangles& rect = setup.rectangles;
    const FloatVec lower_x = splat(packet.block_lower_x[block]);
    const FloatVec upper_x = splat(packet.block_upper_x[block]);
    const FloatVec lower_y = splat(packet.block_lower_y[block]);
    const FloatVec upper_y = splat(packet.block_upper_y[block]);
    const FloatVec q = splat(packet.block_q[block]);
    std::uint32_t triangles = 0;
    for (std::size_t l = 0; l < kLeafTriangles; l += kLanes) {
        const Mask x = (load(rect.lower_x + l) <= upper_x) & (load(rect.upper_x + l) >= lower_x);
        const Mask y = (load(rect.lower_y + l) <= upper_y) & (load(rect.upper_y + l) >= lower_y);
        const Mask near = load(setup.q + l) >= q;
        triangles |= bits_of(near & (x & y)) << l;
    }
    return triangles;
}

}  // namespace HWY_NAMESPACE
}  // namespace morphray::cpu
HWY_AFTER_NAMESPACE();

#endif
