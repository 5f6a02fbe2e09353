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
#include "cpu/simd/rule_vectors-inl.h"

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
    HWY_INLINE VF least_edge(VF x, VF y) const {
        const VF u = hn::MulAdd(a0, x, hn::MulAdd(b0, y, c0));
        const VF v = hn::MulAdd(a1, x, hn::MulAdd(b1, y, c1));
        const VF w = hn::MulAdd(a2, x, hn::MulAdd(b2, y, c2));
        return hn::Min(u, hn::Min(v, w));
    }
    HWY_INLINE VF depth(VF x, VF y) const {
        return hn::MulAdd(depth_a, x, hn::MulAdd(depth_b, y, depth_c));
    }

    VF a0, a1, a2, b0, b1, b2, c0, c1, c2;
    VF depth_a, depth_b, depth_c;
    VF bound;
};

/// Likewise with a block of a point's packet.
struct PointPlanes : Planes {
    HWY_INLINE PointPlanes(const Setup& setup, std::uint32_t i)
        : Planes(setup, i),
          error0(splat(setup.c0[i])),
          error1(splat(setup.c1[i])),
          error2(splat(setup.c2[i])) {}

    VF error0, error1, error2;
};

/// What the bounds say of a triangle and as many rays (x, y) as there are lanes: the least edge
/// function, and 1/z from q_lower to q_upper. Of a NaN, from an overflow, nothing is certain.
struct Position {
    HWY_INLINE Position(const PointPlanes& p, VF x, VF y) : least(p.least_edge(x, y)) {
        const VF q = p.depth(x, y);
        const VF error = hn::MulAdd(q, hn::MulAdd(q, p.error2, p.error1), p.error0);
        q_lower = hn::Sub(q, error);
        q_upper = hn::Add(q, error);
        is_far = hn::Le(hn::Mul(q, p.error2), splat(kFarDepth));
    }

    /// The rays that certainly hit the triangle, nearer than their best.
    HWY_INLINE Mask wins(const Planes& p, VF best_upper) const {
        return hn::And(hn::Gt(least, p.bound), hn::Gt(q_lower, best_upper));
    }

    /// Those that certainly do not.
    HWY_INLINE Mask loses(const Planes& p, VF best_lower) const {
        return hn::Or(hn::Lt(least, hn::Neg(p.bound)),
                      hn::And(is_far, hn::Lt(q_upper, best_lower)));
    }

    VF least, q_lower, q_upper;
    /// So far that q_upper holds.
    Mask is_far;
};

/// The triangles of a leaf whose rectangle meets a block and that are near enough for it.
HWY_INLINE std::uint32_t triangles_at(const Packet& packet, const Setup& setup,
                                      std::uint32_t block) {
    const Floats f;
    const Rectangles& rect = setup.rectangles;
    const VF lower_x = splat(packet.block_lower_x[block]);
    const VF upper_x = splat(packet.block_upper_x[block]);
    const VF lower_y = splat(packet.block_lower_y[block]);
    const VF upper_y = splat(packet.block_upper_y[block]);
    const VF q = splat(packet.block_q[block]);
    std::uint32_t triangles = 0;
    for (std::size_t l = 0; l < kLeafTriangles; l += hn::Lanes(f)) {
        const Mask x = hn::And(hn::Le(hn::Load(f, rect.lower_x + l), upper_x),
                               hn::Ge(hn::Load(f, rect.upper_x + l), lower_x));
        const Mask y = hn::And(hn::Le(hn::Load(f, rect.lower_y + l), upper_y),
                               hn::Ge(hn::Load(f, rect.upper_y + l), lower_y));
        const Mask near = hn::Ge(hn::Load(f, setup.q + l), q);
        triangles |= mask_bits(hn::And(near, hn::And(x, y))) << l;
    }
    return triangles;
}

}  // namespace HWY_NAMESPACE
}  // namespace morphray::cpu
HWY_AFTER_NAMESPACE();

#endif
