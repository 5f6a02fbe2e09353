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

/// Where the blocks are those of a camera's grid, column c holds x from 4 c - 15.5 to 4 c - 12.5,
/// up to the margin, rows alike. A range of columns or rows first..last, first from 0 to 8 and last
/// from -1 to 7, has the index first * 9 + last + 1.
struct alignas(64) GridRanges {
    std::uint32_t columns[16], rows[16];
};

/// The ranges that rectangles meet.
HWY_INLINE void to_grid(const Rectangles& r, float margin, GridRanges& ranges) {
    const Floats f;
    const auto range = [&](const float* lower, const float* upper, std::uint32_t* out) HWY_ATTR {
        const VF first =
            hn::Ceil(hn::Mul(hn::Add(hn::Load(f, lower), splat(12.5f - margin)), splat(0.25f)));
        const VF last =
            hn::Floor(hn::Mul(hn::Add(hn::Load(f, upper), splat(15.5f + margin)), splat(0.25f)));
        const VF clamped_first = hn::Max(hn::Min(first, splat(8.0f)), splat(0.0f));
        const VF clamped_last = hn::Max(hn::Min(last, splat(7.0f)), splat(-1.0f));
        const VF index = hn::Add(hn::MulAdd(clamped_first, splat(9.0f), clamped_last), splat(1.0f));
        const hn::RebindToSigned<Floats> ints;
        hn::Store(hn::BitCast(Words(), hn::ConvertTo(ints, index)), Words(), out);
    };
    for (std::size_t l = 0; l < 16; l += hn::Lanes(f)) {
        range(r.lower_x + l, r.upper_x + l, ranges.columns + l);
        range(r.lower_y + l, r.upper_y + l, ranges.rows + l);
    }
}

HWY_INLINE std::uint64_t blocks_of_grid(const GridRanges& ranges, std::uint32_t i) {
    return kGridMasks.columns[ranges.columns[i]] & kGridMasks.rows[ranges.rows[i]];
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
