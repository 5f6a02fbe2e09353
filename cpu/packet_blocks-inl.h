// Which blocks of a packet a rectangle of its plane, or a depth, concerns.

#if defined(MORPHRAY_PACKET_BLOCKS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_PACKET_BLOCKS_INL_H
#undef MORPHRAY_PACKET_BLOCKS_INL_H
#else
#define MORPHRAY_PACKET_BLOCKS_INL_H
#endif

#include <hwy/highway.h>

#include <cstdint>

#include "cpu/packet.h"
#include "cpu/rule_vectors-inl.h"

HWY_BEFORE_NAMESPACE();
namespace morphray::cpu {
namespace HWY_NAMESPACE {

/// Rectangles in the packet's plane, sixteen at a time.
struct alignas(64) Rectangles {
    float lower_x[16], upper_x[16], lower_y[16], upper_y[16];
};

/// The blocks whose rays may lie in a rectangle.
HWY_INLINE std::uint64_t blocks_in(const Packet& packet, const Rectangles& r, std::uint32_t i) {
    const Floats f;
    std::uint64_t blocks = 0;
    const VF lx = splat(r.lower_x[i]);
    const VF ux = splat(r.upper_x[i]);
    const VF ly = splat(r.lower_y[i]);
    const VF uy = splat(r.upper_y[i]);
    for (std::size_t b = 0; b < kPacketBlocks; b += hn::Lanes(f)) {
        const Mask x = hn::And(hn::Le(lx, hn::Load(f, packet.block_upper_x + b)),
                               hn::Ge(ux, hn::Load(f, packet.block_lower_x + b)));
        const Mask y = hn::And(hn::Le(ly, hn::Load(f, packet.block_upper_y + b)),
                               hn::Ge(uy, hn::Load(f, packet.block_lower_y + b)));
        blocks |= std::uint64_t{mask_bits(hn::And(x, y))} << b;
    }
    return blocks;
}

/// Likewise where the blocks are those of a camera's grid: column c holds x from 4 c - 15.5 to 4 c
/// - 12.5, up to the margin, rows alike. Turns rectangles into such columns and rows, as floats
/// between -1 and 8.
HWY_INLINE void to_grid(Rectangles& r, float margin) {
    const Floats f;
    const auto first = [&](float* x) {
        const VF c =
            hn::Ceil(hn::Mul(hn::Add(hn::Load(f, x), splat(12.5f - margin)), splat(0.25f)));
        hn::Store(hn::Max(hn::Min(c, splat(8.0f)), splat(0.0f)), f, x);
    };
    const auto last = [&](float* x) {
        const VF c =
            hn::Floor(hn::Mul(hn::Add(hn::Load(f, x), splat(15.5f + margin)), splat(0.25f)));
        hn::Store(hn::Max(hn::Min(c, splat(7.0f)), splat(-1.0f)), f, x);
    };
    for (std::size_t l = 0; l < 16; l += hn::Lanes(f)) {
        first(r.lower_x + l);
        last(r.upper_x + l);
        first(r.lower_y + l);
        last(r.upper_y + l);
    }
}

HWY_INLINE std::uint64_t blocks_of_grid(const Rectangles& r, std::uint32_t i) {
    const auto c0 = static_cast<int>(r.lower_x[i]);
    const auto c1 = static_cast<int>(r.upper_x[i]);
    const auto r0 = static_cast<int>(r.lower_y[i]);
    const auto r1 = static_cast<int>(r.upper_y[i]);
    if (c0 > c1 || r0 > r1) return 0;
    const std::uint64_t columns = (0xFFu << c0) & (0xFFu >> (7 - c1));
    const std::uint64_t rows =
        (~std::uint64_t{0} << (8 * r0)) & (~std::uint64_t{0} >> (8 * (7 - r1)));
    return (columns * 0x0101010101010101u) & rows;
}

/// The blocks with a ray that something at 1/z = q or less may still matter to.
HWY_INLINE std::uint64_t blocks_beyond(const Packet& packet, float q) {
    const Floats f;
    std::uint64_t blocks = 0;
    for (std::size_t b = 0; b < kPacketBlocks; b += hn::Lanes(f)) {
        blocks |= std::uint64_t{mask_bits(hn::Ge(splat(q), hn::Load(f, packet.block_q + b)))} << b;
    }
    return blocks;
}

/// 1/z for the nearest that a hit may be, `near`, which is all there is where that is not positive.
HWY_INLINE VF nearest_q(VF near) {
    const VF q = hn::Div(splat(1.00001f), hn::Max(near, splat(1e-20f)));
    return hn::IfThenElse(hn::Gt(near, hn::Zero(Floats())), q, splat(kAnyDepth));
}

}  // namespace HWY_NAMESPACE
}  // namespace morphray::cpu
HWY_AFTER_NAMESPACE();

#endif
