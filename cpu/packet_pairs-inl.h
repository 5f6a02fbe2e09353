// Triangles that have been set up against blocks of a packet: what the bounds say of single rays,
// and which pairs are worth a look at all.

#if defined(MORPHRAY_PACKET_PAIRS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_PACKET_PAIRS_INL_H
#undef MORPHRAY_PACKET_PAIRS_INL_H
#else
#define MORPHRAY_PACKET_PAIRS_INL_H
#endif

#include <hwy/highway.h>

#include <cstddef>
#include <cstdint>

#include "cpu/packet.h"
#include "cpu/packet_setup-inl.h"
#include "cpu/rule_vectors-inl.h"

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
          bound(splat(setup.bound[i])),
          error0(splat(setup.c0[i])),
          error1(splat(setup.c1[i])),
          error2(splat(setup.c2[i])) {}

    VF a0, a1, a2, b0, b1, b2, c0, c1, c2;
    VF depth_a, depth_b, depth_c;
    VF bound, error0, error1, error2;
};

HWY_INLINE VF q_error(const Planes& p, VF q) {
    return hn::MulAdd(q, hn::MulAdd(q, p.error2, p.error1), p.error0);
}

/// What the bounds say of a triangle and as many rays (x, y) as there are lanes: the least edge
/// function, and 1/z from q_lower to q_upper. Of a NaN, from an overflow, nothing is certain.
struct Position {
    HWY_INLINE Position(const Planes& p, VF x, VF y) {
        const VF u = hn::MulAdd(p.a0, x, hn::MulAdd(p.b0, y, p.c0));
        const VF v = hn::MulAdd(p.a1, x, hn::MulAdd(p.b1, y, p.c1));
        const VF w = hn::MulAdd(p.a2, x, hn::MulAdd(p.b2, y, p.c2));
        least = hn::Min(u, hn::Min(v, w));
        const VF q = hn::MulAdd(p.depth_a, x, hn::MulAdd(p.depth_b, y, p.depth_c));
        const VF error = q_error(p, q);
        q_lower = hn::Sub(q, error);
        q_upper = hn::Add(q, error);
    }

    /// The rays that certainly hit the triangle, nearer than their best.
    HWY_INLINE Mask wins(const Planes& p, VF best_upper) const {
        return hn::And(hn::Gt(least, p.bound), hn::Gt(q_lower, best_upper));
    }

    /// Those that certainly do not.
    HWY_INLINE Mask loses(const Planes& p, VF best_lower) const {
        return hn::Or(hn::Lt(least, hn::Neg(p.bound)), hn::Lt(q_upper, best_lower));
    }

    VF least, q_lower, q_upper;
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

/// A triangle against whole blocks of a camera's packet: of those that its rectangle meets some lie
/// beside it.
class BlockTest {
public:
    HWY_INLINE BlockTest(const PacketFrame& frame, const Planes& p) : p_(p) {
        // From a block's middle to its outermost rays.
        const VF half = splat(0.5f * (kBlockSide - 1) + frame.grid_margin);
        const auto most = [&](VF a, VF b, VF c) HWY_ATTR {
            return hn::MulAdd(hn::Add(hn::Abs(a), hn::Abs(b)), half, c);
        };
        c0_ = most(p.a0, p.b0, p.c0);
        c1_ = most(p.a1, p.b1, p.c1);
        c2_ = most(p.a2, p.b2, p.c2);
        depth_c_ = most(p.depth_a, p.depth_b, p.depth_c);
    }

    /// Whether no ray of the blocks with these middles goes through it.
    HWY_INLINE Mask outside(VF x, VF y) const {
        const VF u = hn::MulAdd(p_.a0, x, hn::MulAdd(p_.b0, y, c0_));
        const VF v = hn::MulAdd(p_.a1, x, hn::MulAdd(p_.b1, y, c1_));
        const VF w = hn::MulAdd(p_.a2, x, hn::MulAdd(p_.b2, y, c2_));
        return hn::Lt(hn::Min(u, hn::Min(v, w)), hn::Neg(p_.bound));
    }

    /// At least 1/z of all rays there.
    HWY_INLINE VF q_upper(VF x, VF y) const {
        const VF q = hn::MulAdd(p_.depth_a, x, hn::MulAdd(p_.depth_b, y, depth_c_));
        return hn::Add(q, q_error(p_, q));
    }

private:
    const Planes& p_;
    VF c0_, c1_, c2_, depth_c_;
};

/// The blocks of a word of which a ray may win with a triangle.
HWY_INLINE std::uint64_t grid_blocks_met(const Packet& packet, const BlockTest& test,
                                         std::size_t word) {
    const Floats f;
    std::uint64_t blocks = 0;
    for (std::size_t l = 0; l < 64; l += hn::Lanes(f)) {
        const std::size_t b = 64 * word + l;
        const VF x = hn::Load(f, kGridMiddles.x + b);
        const VF y = hn::Load(f, kGridMiddles.y + b);
        const Mask out =
            hn::Or(test.outside(x, y), hn::Lt(test.q_upper(x, y), hn::Load(f, packet.block_q + b)));
        blocks |= std::uint64_t{mask_bits(hn::Not(out))} << l;
    }
    return blocks;
}

/// Those of a window of 4 x 4 blocks that a triangle's rays may lie in, as they are in a word.
HWY_INLINE std::uint64_t window_blocks_met(const BlockTest& test, std::uint32_t first) {
    const Floats f;
    std::uint32_t met = 0;
    for (std::size_t l = 0; l < 16; l += hn::Lanes(f)) {
        const VF x = hn::Add(splat(kGridMiddles.x[first]), hn::Load(f, kWindowBlocks.x + l));
        const VF y = hn::Add(splat(kGridMiddles.y[first]), hn::Load(f, kWindowBlocks.y + l));
        met |= mask_bits(hn::Not(test.outside(x, y))) << l;
    }
    const std::uint64_t m = met;
    return (m & 0xF) | (m & 0xF0) << 12 | (m & 0xF00) << 24 | (m & 0xF000) << 36;
}

}  // namespace HWY_NAMESPACE
}  // namespace morphray::cpu
HWY_AFTER_NAMESPACE();

#endif
