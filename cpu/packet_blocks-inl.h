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

/// Blocks of a packet as bits: those of a point's in a word, of a camera's four rows a word.
template <std::size_t kWords>
struct BlockSet {
    std::uint64_t words[kWords];
};

/// The blocks of a point's group with rays that may lie in a rectangle (lower x, upper x, lower y,
/// upper y), and that something at 1/z = q or less may still matter to.
HWY_INLINE std::uint32_t blocks_in(const Packet& packet, const float rectangle[4], float q,
                                   std::uint32_t group) {
    const Floats f;
    std::uint32_t blocks = 0;
    for (std::size_t l = 0; l < kGroupBlocks; l += hn::Lanes(f)) {
        const std::size_t b = group * kGroupBlocks + l;
        const Mask x = hn::And(hn::Le(splat(rectangle[0]), hn::Load(f, packet.block_upper_x + b)),
                               hn::Ge(splat(rectangle[1]), hn::Load(f, packet.block_lower_x + b)));
        const Mask y = hn::And(hn::Le(splat(rectangle[2]), hn::Load(f, packet.block_upper_y + b)),
                               hn::Ge(splat(rectangle[3]), hn::Load(f, packet.block_lower_y + b)));
        const Mask near = hn::Ge(splat(q), hn::Load(f, packet.block_q + b));
        blocks |= mask_bits(hn::And(near, hn::And(x, y))) << l;
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
    const Floats f;
    QuadSet quads = {};
    const auto find = [&](std::uint32_t word, std::size_t count) HWY_ATTR {
        for (std::size_t l = 0; l < count; l += hn::Lanes(f)) {
            const std::size_t k = 64 * word + l;
            const Mask x =
                hn::And(hn::Le(splat(r.lower_x[i]), hn::Load(f, packet.quad_upper_x + k)),
                        hn::Ge(splat(r.upper_x[i]), hn::Load(f, packet.quad_lower_x + k)));
            const Mask y =
                hn::And(hn::Le(splat(r.lower_y[i]), hn::Load(f, packet.quad_upper_y + k)),
                        hn::Ge(splat(r.upper_y[i]), hn::Load(f, packet.quad_lower_y + k)));
            const Mask near = hn::Ge(splat(q), hn::Load(f, packet.quad_q + k));
            quads.words[word] |= std::uint64_t{mask_bits(hn::And(near, hn::And(x, y)))} << l;
        }
        quads.words[word] &= among.words[word];
    };
    find(0, kPointQuads / 2);
    if (packet.moved_count != 0) find(1, (packet.moved_count + kQuadBlocks - 1) / kQuadBlocks);
    return quads;
}

/// Those among some with a ray that something at 1/z = q or less may still matter to.
HWY_INLINE QuadSet quads_beyond(const Packet& packet, float q, const QuadSet& among) {
    const Floats f;
    QuadSet quads = {};
    const auto find = [&](std::uint32_t word, std::size_t count) HWY_ATTR {
        for (std::size_t l = 0; l < count; l += hn::Lanes(f)) {
            const Mask near = hn::Ge(splat(q), hn::Load(f, packet.quad_q + 64 * word + l));
            quads.words[word] |= std::uint64_t{mask_bits(near)} << l;
        }
        quads.words[word] &= among.words[word];
    };
    find(0, kPointQuads / 2);
    if (packet.moved_count != 0) find(1, (packet.moved_count + kQuadBlocks - 1) / kQuadBlocks);
    return quads;
}

/// Of the first `count` columns, or rows, of a camera's blocks those that some bounds meet: from
/// begin on and before end, which is not less. Column c holds x from 4 c - 31.5 to 4 c - 28.5, up
/// to the margin, rows alike.
struct GridRange {
    VF begin, end;

    HWY_INLINE GridRange(VF lower, VF upper, float margin, std::uint32_t count) {
        constexpr float kFirst = 0.5f - 0.5f * kCameraSide;
        constexpr float kLast = kFirst + (kBlockSide - 1);
        const VF side = splat(static_cast<float>(count));
        const VF quarter = splat(1.0f / kBlockSide);
        const VF first = hn::Ceil(hn::Mul(hn::Sub(lower, splat(kLast + margin)), quarter));
        const VF last = hn::Floor(hn::Mul(hn::Sub(upper, splat(kFirst - margin)), quarter));
        begin = hn::Max(hn::Min(first, side), hn::Zero(Floats()));
        end = hn::Max(hn::Min(hn::Add(last, splat(1.0f)), side), begin);
    }

    /// As bits.
    HWY_INLINE VW bits() const { return hn::Sub(bit(end), bit(begin)); }

    static HWY_INLINE VW integer(VF x) {
        return hn::BitCast(Words(), hn::ConvertTo(hn::RebindToSigned<Floats>(), x));
    }

private:
    static HWY_INLINE VW bit(VF place) { return hn::Shl(hn::Set(Words(), 1u), integer(place)); }
};

/// The columns and rows of a camera's blocks that rectangles meet, as bits.
struct alignas(64) GridRanges {
    std::uint32_t columns[16], rows[16];
};

HWY_INLINE void to_grid(const PacketFrame& frame, const Rectangles& r, GridRanges& ranges) {
    const Floats f;
    const float margin = frame.grid_margin;
    for (std::size_t l = 0; l < 16; l += hn::Lanes(f)) {
        const GridRange x(hn::Load(f, r.lower_x + l), hn::Load(f, r.upper_x + l), margin,
                          frame.grid_columns);
        const GridRange y(hn::Load(f, r.lower_y + l), hn::Load(f, r.upper_y + l), margin,
                          frame.grid_rows);
        hn::Store(x.bits(), Words(), ranges.columns + l);
        hn::Store(y.bits(), Words(), ranges.rows + l);
    }
}

/// Which of four rows of blocks there are, as all of their bits.
struct RowMasks {
    std::uint64_t of[16]{};

    constexpr RowMasks() {
        for (std::uint32_t rows = 0; rows < 16; ++rows) {
            for (std::uint32_t row = 0; row < 4; ++row) {
                if ((rows >> row & 1) != 0) of[rows] |= std::uint64_t{0xFFFF} << (row * kGridSide);
            }
        }
    }
};
inline constexpr RowMasks kRowMasks;

/// Windows of up to 4 x 4 blocks by their columns and rows: bit b is that many blocks after the
/// first one.
inline constexpr std::uint32_t kWindowSide = 4;
struct Windows {
    std::uint64_t of[(kWindowSide + 1) * 8]{};

    constexpr Windows() {
        for (std::uint32_t columns = 0; columns <= kWindowSide; ++columns) {
            for (std::uint32_t rows = 0; rows <= kWindowSide; ++rows) {
                for (std::uint32_t row = 0; row < rows; ++row)
                    of[columns * 8 + rows] |= ((std::uint64_t{1} << columns) - 1)
                                              << (row * kGridSide);
            }
        }
    }
};
inline constexpr Windows kWindows;

/// The blocks that rectangles meet: the first ones, and shapes of those that fit into a window; all
/// columns and rows; and which rectangles meet 1 to 4 blocks, more in a window, and more, as bits.
inline constexpr std::uint32_t kFewPairs = 6;
struct alignas(64) GridWindows {
    std::uint32_t first[16], shape[16];
    GridRanges ranges;
    std::uint32_t few, many, large;
};

/// Likewise of rectangles that have a margin already.
HWY_INLINE void to_windows(const PacketFrame& frame, const Rectangles& r, GridWindows& windows) {
    const Floats f;
    windows.few = windows.many = windows.large = 0;
    for (std::size_t l = 0; l < 16; l += hn::Lanes(f)) {
        const GridRange x(hn::Load(f, r.lower_x + l), hn::Load(f, r.upper_x + l), 0,
                          frame.grid_columns);
        const GridRange y(hn::Load(f, r.lower_y + l), hn::Load(f, r.upper_y + l), 0,
                          frame.grid_rows);
        const VF columns = hn::Sub(x.end, x.begin);
        const VF rows = hn::Sub(y.end, y.begin);
        const VF first = hn::MulAdd(y.begin, splat(kGridSide), x.begin);
        const VF side = splat(kWindowSide);
        const VF shape = hn::MulAdd(hn::Min(columns, side), splat(8.0f), hn::Min(rows, side));
        hn::Store(GridRange::integer(first), Words(), windows.first + l);
        hn::Store(GridRange::integer(shape), Words(), windows.shape + l);
        hn::Store(x.bits(), Words(), windows.ranges.columns + l);
        hn::Store(y.bits(), Words(), windows.ranges.rows + l);
        const VF blocks = hn::Mul(columns, rows);
        const std::uint32_t any = mask_bits(hn::Gt(blocks, hn::Zero(f)));
        const std::uint32_t fit = any & mask_bits(hn::Le(hn::Max(columns, rows), side));
        const std::uint32_t few = fit & mask_bits(hn::Le(blocks, splat(kFewPairs)));
        windows.few |= few << l;
        windows.many |= (fit & ~few) << l;
        windows.large |= (any & ~fit) << l;
    }
}

/// Columns in each of four rows of blocks.
inline constexpr std::uint64_t kEachRow = 0x0001000100010001;

/// Those of a word of blocks.
HWY_INLINE std::uint64_t blocks_of_grid(const GridRanges& ranges, std::uint32_t i,
                                        std::size_t word) {
    return ranges.columns[i] * kEachRow & kRowMasks.of[ranges.rows[i] >> (4 * word) & 15];
}

/// Finds what is nearer than all that the rays of a block have found.
HWY_INLINE void find_depth(Packet& packet, std::uint32_t block) {
    const Floats f;
    VF least = splat(kDone);
    for (std::size_t l = 0; l < kBlockRays; l += hn::Lanes(f))
        least = hn::Min(least, hn::Load(f, packet.q_lower + block * kBlockRays + l));
    packet.block_q[block] = hn::GetLane(hn::MinOfLanes(f, least));
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
    const Floats f;
    VF least[4];
    for (int i = 0; i < 4; ++i) {
        const float* const q = packet.q_lower + blocks[i] * kBlockRays;
        least[i] = hn::Load(f, q);
        for (std::size_t l = hn::Lanes(f); l < kBlockRays; l += hn::Lanes(f))
            least[i] = hn::Min(least[i], hn::Load(f, q + l));
    }
    const VF all = combine_four(least, [](VF a, VF b) HWY_ATTR { return hn::Min(a, b); });
    alignas(16) float q[4];
    hn::Store(least_of_quarters(f, all), hn::Full128<float>(), q);
    for (int i = 0; i < 4; ++i) packet.block_q[blocks[i]] = q[i];
#endif
}

/// The blocks of a word with a ray that something at 1/z = q or less may still matter to.
HWY_INLINE std::uint64_t blocks_beyond(const Packet& packet, float q, std::size_t word) {
    const Floats f;
    std::uint64_t blocks = 0;
    const float* block_q = packet.block_q + 64 * word;
    for (std::size_t b = 0; b < 64; b += hn::Lanes(f))
        blocks |= std::uint64_t{mask_bits(hn::Ge(splat(q), hn::Load(f, block_q + b)))} << b;
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
