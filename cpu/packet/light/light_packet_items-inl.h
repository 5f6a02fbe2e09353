// Set-up triangles against blocks of a light packet: which (triangle, block) items need a test at
// all, and what the bounds decide about single rays.

#if defined(MORPHRAY_CPU_PACKET_LIGHT_LIGHT_PACKET_ITEMS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_PACKET_LIGHT_LIGHT_PACKET_ITEMS_INL_H
#undef MORPHRAY_CPU_PACKET_LIGHT_LIGHT_PACKET_ITEMS_INL_H
#else
#define MORPHRAY_CPU_PACKET_LIGHT_LIGHT_PACKET_ITEMS_INL_H
#endif

#include <hwy/highway.h>

#include <cstddef>
#include <cstdint>

#include "common/interop/packet_bounds.h"
#include "cpu/packet/light/light_packet.h"
#include "cpu/packet/packet_triangles-inl.h"
#include "cpu/simd/hit_rule-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {

/// The triangles of a leaf whose rectangle meets a block and that are near enough for it, as bits.
HWY_INLINE std::uint32_t triangles_at(const LightPacket& packet, const LightTriangles& triangles,
                                      std::uint32_t block) {
    const Rectangles& rect = triangles.rectangles;
    const FloatVec lower_x = splat(packet.block_lower_x[block]);
    const FloatVec upper_x = splat(packet.block_upper_x[block]);
    const FloatVec lower_y = splat(packet.block_lower_y[block]);
    const FloatVec upper_y = splat(packet.block_upper_y[block]);
    const FloatVec q = splat(packet.block_q[block]);
    std::uint32_t found = 0;
    for (std::size_t l = 0; l < kLeafTriangles; l += kLanes) {
        const Mask x = (load(rect.lower_x + l) <= upper_x) & (load(rect.upper_x + l) >= lower_x);
        const Mask y = (load(rect.lower_y + l) <= upper_y) & (load(rect.upper_y + l) >= lower_y);
        const Mask near = load(triangles.q + l) >= q;
        found |= bits_of(near & (x & y)) << l;
    }
    return found;
}

/// A set-up triangle in registers, with the error of its 1/z.
struct LightPlanes : Planes {
    HWY_INLINE LightPlanes(const LightTriangles& triangles, std::uint32_t i)
        : Planes(triangles, i),
          error0(splat(triangles.c0[i])),
          error1(splat(triangles.c1[i])),
          error2(splat(triangles.c2[i])) {}

    FloatVec error0, error1, error2;
};

/// The values of a triangle at as many rays (x, y) as there are lanes: the least edge function, and
/// 1/z from q_lower to q_upper. Overflow can make a NaN, for which both tests below are false.
struct Position {
    HWY_INLINE Position(const LightPlanes& p, FloatVec x, FloatVec y) : least(p.least_edge(x, y)) {
        const FloatVec q = p.depth(x, y);
        const FloatVec error = mul_add(q, mul_add(q, p.error2, p.error1), p.error0);
        q_lower = q - error;
        q_upper = q + error;
        is_far = q_upper * p.error2 <= splat(kFarDepth);
    }

    /// The rays that certainly hit the triangle, nearer than their limit.
    HWY_INLINE Mask is_closer(const Planes& p, FloatVec limit_upper) const {
        return (least > p.bound) & (q_lower > limit_upper);
    }

    /// The rays that certainly miss the triangle or hit it beyond their limit.
    HWY_INLINE Mask is_rejected(const Planes& p, FloatVec limit_lower) const {
        return (least < -p.bound) | (is_far & (q_upper < limit_lower));
    }

    FloatVec least, q_lower, q_upper;
    /// Where the triangle is so far away that q_upper holds.
    Mask is_far;
};

/// A set-up triangle in registers, for certainly_misses().
struct MissPlanes {
    HWY_INLINE MissPlanes(const LightTriangles& triangles, std::uint32_t i)
        : a{splat(triangles.a[0][i]), splat(triangles.a[1][i]), splat(triangles.a[2][i])},
          b{splat(triangles.b[0][i]), splat(triangles.b[1][i]), splat(triangles.b[2][i])},
          c{splat(triangles.most_c[0][i]), splat(triangles.most_c[1][i]),
            splat(triangles.most_c[2][i])},
          depth_a(splat(triangles.depth_a[i])),
          depth_b(splat(triangles.depth_b[i])),
          depth_c(splat(triangles.most_q[i])) {}

    FloatVec a[3], b[3], c[3], depth_a, depth_b, depth_c;
};

/// Whether all rays of a block certainly miss a triangle or hit it beyond their limits. It decides
/// less than Position but costs less, since its constants are found once a leaf.
///
/// 1. A ray misses where an edge function is below -bound. most_c = c + kMissBound * bound, and
///    the test is a x + b y + most_c < 0: what kMissBound exceeds 1 by covers the rounding of
///    most_c and of the sums (lab/proofs/packet_any.g).
/// 2. The bounds say nothing of a ray outside the triangle's rectangle, but such a ray misses.
/// 3. The rule hits nothing nearer than q = triangles.q, and the error c0 + q (c1 + q c2) grows
///    with q. So with most_q = depth_c + the error at that q, 1/z of a hit is at most a x + b y +
///    most_q.
/// 4. most_q has kLightErrorFactor times the error, for its own roundings, and kMissGradient
///    times the gradient for that of the sum, since |depth_c| <= 1/z in the middle + reach *
///    gradient.
HWY_INLINE bool certainly_misses(const LightPacket& packet, const MissPlanes& p,
                                 std::uint32_t block) {
    Mask all_miss = zero() == zero();
    for (std::size_t l = 0; l < kBlockRays; l += kLanes) {
        const std::size_t r = block * kBlockRays + l;
        const FloatVec x = load(packet.x + r);
        const FloatVec y = load(packet.y + r);
        const auto edge = [&](int k)
                              HWY_ATTR { return mul_add(p.a[k], x, mul_add(p.b[k], y, p.c[k])); };
        const FloatVec q = mul_add(p.depth_a, x, mul_add(p.depth_b, y, p.depth_c));
        const Mask outside = min3(edge(0), edge(1), edge(2)) < zero();
        const Mask beyond = q < load(packet.q_lower + r);
        all_miss = all_miss & (outside | beyond);
    }
    return all(all_miss);
}

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif
