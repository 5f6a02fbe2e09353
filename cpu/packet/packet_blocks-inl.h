// Which blocks of a packet a rectangle of its plane, or a depth, concerns.

#if defined(MORPHRAY_CPU_PACKET_PACKET_BLOCKS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_PACKET_PACKET_BLOCKS_INL_H
#undef MORPHRAY_CPU_PACKET_PACKET_BLOCKS_INL_H
#else
#define MORPHRAY_CPU_PACKET_PACKET_BLOCKS_INL_H
#endif

#include <hwy/highway.h>

#include <cstdint>

#include "common/interop/packet_bounds.h"
#include "cpu/packet/packet.h"
#include "cpu/simd/fast_hit_rule-inl.h"

HWY_BEFORE_NAMESPACE();
namespace morphray::cpu {
namespace HWY_NAMESPACE {

/// Rectangles in the packet's plane, sixteen at a time.
struct alignas(64) Rectangles {
    float lower_x[16], upper_x[16], lower_y[16], upper_y[16];
};

/// Blocks of a packet as bits: those of a point's in a word, of a camera's four rows a word.
template <std::size_t kWords>
struct BlockSet {
    std::uint64_t words[kWords];
};

/// The blocks of a point's group with rays that may lie in a rectangle (lower x, upper x, lower y,
/// upper y), and that something at 1/z = q or less may still matter to.
HWY_INLINE std::uint32_t blocks_in(const Packet& packet, const float rectangle[4], float q,
                                   std::uint32_t group) {
    std::uint32_t blocks = 0;
    for (std::size_t l = 0; l < kGroupBlocks; l += kLanes) {
        const std::size_t b = group * kGroupBlocks + l;
        const Mask x = (splat(rectangle[0]) <= load(packet.block_upper_x + b)) &
                       (splat(rectangle[1]) >= load(packet.block_lower_x + b));
        const Mask y = (splat(rectangle[2]) <= load(packet.block_upper_y + b)) &
                       (splat(rectangle[3]) >= load(packet.block_lower_y + b));
        const Mask near = splat(q) >= load(packet.block_q + b);
        blocks |= bits_of(near & (x & y)) << l;
    }
    return blocks;
}

/// Quads of a point's packet: those in place and those of blocks put together anew.
struct QuadSet {
    std::uint64_t words[2];

    HWY_INLINE bool any() const { return (words[0] | words[1]) != 0; }
};

/// Likewise the quads among some.
HWY_INLINE QuadSet quads_in(const Packet& packet, const Rectangles& r, float q, std::uint32_t i,
                            const QuadSet& among) {
    QuadSet quads = {};
    const auto find = [&](std::uint32_t word, std::size_t count) HWY_ATTR {
        for (std::size_t l = 0; l < count; l += kLanes) {
            const std::size_t k = 64 * word + l;
            const Mask x = (splat(r.lower_x[i]) <= load(packet.quad_upper_x + k)) &
                           (splat(r.upper_x[i]) >= load(packet.quad_lower_x + k));
            const Mask y = (splat(r.lower_y[i]) <= load(packet.quad_upper_y + k)) &
                           (splat(r.upper_y[i]) >= load(packet.quad_lower_y + k));
            const Mask near = splat(q) >= load(packet.quad_q + k);
            quads.words[word] |= std::uint64_t{bits_of(near & (x & y))} << l;
        }
        quads.words[word] &= among.words[word];
    };
    find(0, kLightPacketQuads / 2);
    if (packet.moved_count != 0) find(1, (packet.moved_count + kQuadBlocks - 1) / kQuadBlocks);
    return quads;
}

/// Those among some with a ray that something at 1/z = q or less may still matter to.
HWY_INLINE QuadSet quads_beyond(const Packet& packet, float q, const QuadSet& among) {
    QuadSet quads = {};
    const auto find = [&](std::uint32_t word, std::size_t count) HWY_ATTR {
        for (std::size_t l = 0; l < count; l += kLanes) {
            const Mask near = splat(q) >= load(packet.quad_q + 64 * word + l);
            quads.words[word] |= std::uint64_t{bits_of(near)} << l;
        }
        quads.words[word] &= among.words[word];
    };
    find(0, kLightPacketQuads / 2);
    if (packet.moved_count != 0) find(1, (packet.moved_count + kQuadBlocks - 1) / kQuadBlocks);
    return quads;
}

/// Of the columns, or rows, of pixels in so many blocks of a camera's grid, those whose middles lie
/// within some bounds, or the margin from there: none if first > last. Pixel k's is at k - 31.5.
struct PixelRange {
    FloatVec first, last;

    HWY_INLINE PixelRange(FloatVec lower, FloatVec upper, float margin, std::uint32_t blocks) {
        constexpr float kMiddle = 0.5f * kCameraSide - 0.5f;
        const FloatVec end = splat(static_cast<float>(blocks * kBlockSide - 1));
        first = max(hn::Ceil(lower + splat(kMiddle - margin)), zero());
        last = min(hn::Floor(upper + splat(kMiddle + margin)), end);
    }

    HWY_INLINE Mask any() const { return first <= last; }

    /// The blocks of the first and of the last, if there are any.
    HWY_INLINE UintVec first_block() const { return block(first); }
    HWY_INLINE UintVec last_block() const { return block(last); }

private:
    static HWY_INLINE UintVec block(FloatVec pixel) {
        static_assert(kBlockSide == 4);
        const UintVec block = shift_right<2>(as_uint(hn::ConvertTo(kInts, pixel)));
        // A number to shift by even where there is none.
        return block & splat(kGridSide - 1);
    }
};

/// The columns and rows of a camera's blocks that rectangles meet, as bits.
struct alignas(64) GridRanges {
    std::uint32_t columns[16], rows[16];
};

HWY_INLINE void to_grid(const PacketFrame& frame, const Rectangles& r, GridRanges& ranges) {
    const auto bits = [&](const PixelRange& range) HWY_ATTR {
        const UintVec below = hn::Shl(splat(1u), range.first_block());
        const UintVec up_to = hn::Shl(splat(2u), range.last_block());
        return zero_unless(uint_mask(range.any()), up_to - below);
    };
    const float margin = frame.grid_margin;
    for (std::size_t l = 0; l < 16; l += kLanes) {
        const PixelRange x(load(r.lower_x + l), load(r.upper_x + l), margin, frame.grid_columns);
        const PixelRange y(load(r.lower_y + l), load(r.upper_y + l), margin, frame.grid_rows);
        store(bits(x), ranges.columns + l);
        store(bits(y), ranges.rows + l);
    }
}

/// Windows of up to 4 x 4 blocks by the numbers of columns and rows after the first: bit b is that
/// many blocks after the first one. And their places, row by row, as bits.
inline constexpr std::uint32_t kWindowSide = 4;
struct Windows {
    std::uint64_t of[kWindowSide][kWindowSide]{};
    std::uint32_t places[kWindowSide][kWindowSide]{};

    constexpr Windows() {
        for (std::uint32_t columns = 0; columns < kWindowSide; ++columns) {
            for (std::uint32_t rows = 0; rows < kWindowSide; ++rows) {
                for (std::uint32_t row = 0; row <= rows; ++row) {
                    const std::uint64_t all = (2u << columns) - 1;
                    of[columns][rows] |= all << (row * kGridSide);
                    places[columns][rows] |= static_cast<std::uint32_t>(all) << row * kWindowSide;
                }
            }
        }
    }
};
inline constexpr Windows kWindows;

/// What up to sixteen triangles meet of a camera's blocks: the first one, and how many columns and
/// rows after its; and which of them meet a window, and among these no more than six blocks: three
/// columns and rows after the first together.
struct alignas(64) GridWindows {
    std::uint32_t first[16], columns[16], rows[16];
    std::uint32_t fit = 0, few = 0;

    HWY_INLINE void set(std::size_t l, const PixelRange& x, const PixelRange& y) {
        const UintVec left = x.first_block();
        const UintVec top = y.first_block();
        const UintVec more_columns = x.last_block() - left;
        const UintVec more_rows = y.last_block() - top;
        static_assert(kGridSide == 16);
        store(shift_left<4>(top) | left, first + l);
        store(more_columns, columns + l);
        store(more_rows, rows + l);
        const auto below = [&](UintVec number, std::int32_t end) HWY_ATTR {
            const auto is = as_int(number) < splat(end);
            return bits_of(float_mask(is)) << l;
        };
        fit |= below(max(more_columns, more_rows), kWindowSide);
        few |= below(more_columns + more_rows, 4);
    }
};

/// Columns in each of four rows of blocks.
inline constexpr std::uint64_t kEachRow = 0x0001000100010001;

/// The blocks of some columns and rows among others. Whether there are any. Written and read as
/// vectors: what is read as one must not have been written in parts just before.
HWY_INLINE bool blocks_of_grid(std::uint32_t columns, std::uint32_t rows,
                               const BlockSet<kGridBlocks / 64>& among,
                               BlockSet<kGridBlocks / 64>& out) {
#if HWY_TARGET == HWY_SCALAR
    out = {};
    std::uint64_t any = 0;
    for (std::uint32_t row = 0; row < kGridSide; ++row) {
        if ((rows >> row & 1) == 0) continue;
        const std::uint64_t own = std::uint64_t{columns} << row % 4 * kGridSide;
        out.words[row / 4] |= among.words[row / 4] & own;
        any |= among.words[row / 4] & own;
    }
    return any != 0;
#else
    const hn::CappedTag<std::uint16_t, kGridSide> d;
    const hn::Repartition<std::uint64_t, decltype(d)> words;
    bool any = false;
    for (std::uint32_t row = 0; row < kGridSide; row += static_cast<std::uint32_t>(hn::Lanes(d))) {
        const std::uint8_t bytes[8] = {static_cast<std::uint8_t>(rows >> row),
                                       static_cast<std::uint8_t>(rows >> row >> 8)};
        const auto own = hn::IfThenElseZero(hn::LoadMaskBits(d, bytes),
                                            hn::Set(d, static_cast<std::uint16_t>(columns)));
        const auto blocks = own & hn::BitCast(d, hn::LoadU(words, among.words + row / 4));
        any |= !hn::AllTrue(d, blocks == hn::Zero(d));
        hn::StoreU(hn::BitCast(words, blocks), words, out.words + row / 4);
    }
    return any;
#endif
}

/// Finds what is nearer than all that the rays of a block have found.
HWY_INLINE void find_depth(Packet& packet, std::uint32_t block) {
    FloatVec least = splat(kDone);
    for (std::size_t l = 0; l < kBlockRays; l += kLanes)
        least = min(least, load(packet.q_lower + block * kBlockRays + l));
    packet.block_q[block] = hn::GetLane(hn::MinOfLanes(kFloats, least));
}

#if HWY_TARGET != HWY_SCALAR
/// The least of each lane and those four after it, eight, and so on.
template <class D>
HWY_INLINE auto least_of_quarters(D d, hn::Vec<D> v) {
    if constexpr (hn::MaxLanes(d) <= 4) {
        return v;
    } else {
        const hn::Half<D> half;
        return least_of_quarters(half, hn::Min(hn::LowerHalf(half, v), hn::UpperHalf(half, v)));
    }
}
#endif

/// Likewise of four blocks of a camera's packet at once.
HWY_INLINE void find_four_depths(Packet& packet, const std::uint32_t blocks[4]) {
#if HWY_TARGET == HWY_SCALAR
    for (int i = 0; i < 4; ++i) find_depth(packet, blocks[i]);
#else
    FloatVec least[4];
    for (int i = 0; i < 4; ++i) {
        const float* const q = packet.q_lower + blocks[i] * kBlockRays;
        least[i] = load(q);
        for (std::size_t l = kLanes; l < kBlockRays; l += kLanes)
            least[i] = min(least[i], load(q + l));
    }
    const FloatVec all =
        combine_four(least, [](FloatVec a, FloatVec b) HWY_ATTR { return min(a, b); });
    alignas(16) float q[4];
    hn::Store(least_of_quarters(kFloats, all), hn::Full128<float>(), q);
    for (int i = 0; i < 4; ++i) packet.block_q[blocks[i]] = q[i];
#endif
}

/// The blocks of a word with a ray that something at 1/z = q or less may still matter to.
HWY_INLINE std::uint64_t blocks_beyond(const Packet& packet, float q, std::size_t word) {
    std::uint64_t blocks = 0;
    const float* block_q = packet.block_q + 64 * word;
    for (std::size_t b = 0; b < 64; b += kLanes)
        blocks |= std::uint64_t{bits_of(splat(q) >= load(block_q + b))} << b;
    return blocks;
}

/// 1/z for the nearest that a hit may be, `near`, which is all there is where that is not positive.
HWY_INLINE FloatVec nearest_q(FloatVec near) {
    const FloatVec q = splat(kNearestByDepth) / max(near, splat(1e-20f));
    return select(near > zero(), q, splat(kAnyDepth));
}

}  // namespace HWY_NAMESPACE
}  // namespace morphray::cpu
HWY_AFTER_NAMESPACE();

#endif
