// The blocks of a camera packet that a rectangle of its plane or a depth concerns.

#if defined(MORPHRAY_CPU_PACKET_CAMERA_CAMERA_PACKET_BLOCKS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_PACKET_CAMERA_CAMERA_PACKET_BLOCKS_INL_H
#undef MORPHRAY_CPU_PACKET_CAMERA_CAMERA_PACKET_BLOCKS_INL_H
#else
#define MORPHRAY_CPU_PACKET_CAMERA_CAMERA_PACKET_BLOCKS_INL_H
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "cpu/packet/camera/camera_packet.h"
#include "cpu/packet/packet_frame-inl.h"
#include "cpu/simd/hit_rule-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {

/// Blocks of a camera packet as bits, four rows of blocks a word.
struct BlockSet {
    std::uint64_t words[kGridWords];
};

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

    /// The blocks that hold the first and the last pixel, if there are any.
    HWY_INLINE UintVec first_block() const { return block(first); }
    HWY_INLINE UintVec last_block() const { return block(last); }

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
        const UintVec block = shift_right<2>(as_uint(hn::ConvertTo(kInts, pixel)));
        // Without pixels it still must be a valid shift count.
        return block & splat(kGridSide - 1);
    }
};

/// Pixels of a packet: the first and the last column, and the first and the last row.
struct PixelRectangle {
    std::uint8_t first_x, last_x, first_y, last_y;

    static constexpr PixelRectangle none() { return {kCameraSide, 0, kCameraSide, 0}; }
    bool empty() const { return first_x > last_x; }
    /// For a rectangle that is not empty.
    std::uint32_t count() const { return (last_x - first_x + 1u) * (last_y - first_y + 1u); }
};

/// The columns and rows of blocks that rectangles meet, as bits, and the pixels that they meet.
struct alignas(64) GridRanges {
    std::uint32_t columns[16], rows[16];
    PixelRectangle pixels[16];
};

/// Finds which of some pixels lie within `margin` of rectangles.
HWY_INLINE void to_grid(float margin, const PixelRectangle& pixels, const Rectangles& r,
                        GridRanges& ranges) {
    const auto bits = [&](const PixelRange& range) HWY_ATTR {
        const UintVec below = hn::Shl(splat(1u), range.first_block());
        const UintVec up_to = hn::Shl(splat(2u), range.last_block());
        return zero_unless(uint_mask(range.any()), up_to - below);
    };
    for (std::size_t l = 0; l < 16; l += kLanes) {
        const PixelRange x(load(r.lower_x + l), load(r.upper_x + l), margin, pixels.first_x,
                           pixels.last_x);
        const PixelRange y(load(r.lower_y + l), load(r.upper_y + l), margin, pixels.first_y,
                           pixels.last_y);
        store(bits(x), ranges.columns + l);
        store(bits(y), ranges.rows + l);
        alignas(64) std::uint32_t own[kLanes];
        store(x.pixels() | shift_left<16>(y.pixels()), own);
        std::memcpy(ranges.pixels + l, own, sizeof own);
    }
}

/// Windows of up to 4 x 4 blocks, by the numbers of columns and rows after the first: bit b stands
/// for the block b after the window's first one in the packet.
struct Windows {
    std::uint64_t blocks[4][4]{};

    constexpr Windows() {
        for (std::uint32_t columns = 0; columns < 4; ++columns) {
            for (std::uint32_t rows = 0; rows < 4; ++rows) {
                for (std::uint32_t row = 0; row <= rows; ++row)
                    blocks[columns][rows] |= std::uint64_t{(2u << columns) - 1} << row * kGridSide;
            }
        }
    }
};
inline constexpr Windows kWindows;

/// The blocks that up to sixteen triangles meet: the first one, and how many columns and rows more.
/// `few`, as bits, meet at most six blocks, because they have fewer than kFewSteps columns and rows
/// more together.
struct alignas(64) GridWindows {
    std::uint32_t first[16], columns[16], rows[16];
    std::uint32_t few = 0;

    static constexpr std::int32_t kFewSteps = 4;

    /// Sets as many triangles as there are lanes, from l on.
    HWY_INLINE void set(std::size_t l, const PixelRange& x, const PixelRange& y) {
        const UintVec left = x.first_block();
        const UintVec top = y.first_block();
        const UintVec more_columns = x.last_block() - left;
        const UintVec more_rows = y.last_block() - top;
        static_assert(kGridSide == 16);
        store(shift_left<4>(top) | left, first + l);
        store(more_columns, columns + l);
        store(more_rows, rows + l);
        const auto is_few = as_int(more_columns + more_rows) < splat(kFewSteps);
        few |= bits_of(float_mask(is_few)) << l;
    }
};

/// A word with the first column of each of its four rows of blocks.
inline constexpr std::uint64_t kEachRow = 0x0001000100010001;

/// The blocks of some of a word's four rows, which are bits.
struct WordRows {
    std::uint64_t blocks[16]{};

    constexpr WordRows() {
        for (std::uint64_t rows = 0; rows < 16; ++rows) {
            for (std::uint32_t row = 0; row < 4; ++row)
                blocks[rows] |= (rows >> row & 1) * 0xFFFF << row * kGridSide;
        }
    }
};
inline constexpr WordRows kWordRows;

/// Finds the blocks of `among` in some columns and rows. Returns whether there are any.
HWY_INLINE bool blocks_of_grid(std::uint32_t columns, std::uint32_t rows, const BlockSet& among,
                               BlockSet& out) {
    const std::uint64_t of_columns = columns * kEachRow;
    std::uint64_t any = 0;
    for (std::uint32_t w = 0; w < kGridWords; ++w) {
        out.words[w] = among.words[w] & of_columns & kWordRows.blocks[rows >> 4 * w & 15];
        any |= out.words[w];
    }
    return any != 0;
}

/// Updates block_q of four blocks at once from their rays.
HWY_INLINE void find_four_depths(CameraPacket& packet, const std::uint32_t blocks[4]) {
    FloatVec least[4];
    for (int i = 0; i < 4; ++i) {
        const float* const q = packet.q_lower + blocks[i] * kBlockRays;
        least[i] = load(q);
        for (std::size_t l = kLanes; l < kBlockRays; l += kLanes)
            least[i] = min(least[i], load(q + l));
    }
    alignas(16) float q[4];
    reduce_four(
        least, [](auto a, auto b) HWY_ATTR { return hn::Min(a, b); }, q);
    for (int i = 0; i < 4; ++i) packet.block_q[blocks[i]] = q[i];
}

/// The blocks of a word that hold a ray that a hit at 1/z <= q may concern, as bits.
HWY_INLINE std::uint64_t blocks_beyond(const CameraPacket& packet, float q, std::size_t word) {
    std::uint64_t blocks = 0;
    const float* block_q = packet.block_q + 64 * word;
    for (std::size_t b = 0; b < 64; b += kLanes)
        blocks |= std::uint64_t{bits_of(splat(q) >= load(block_q + b))} << b;
    return blocks;
}

/// The rays of a block within `pixels` that a hit at 1/z <= q may concern, as bits.
HWY_INLINE std::uint32_t rays_beyond(const CameraPacket& packet, float q, std::uint32_t block,
                                     const PixelRectangle& pixels) {
    const int x = static_cast<int>(block % kGridSide * kBlockSide);
    const int y = static_cast<int>(block / kGridSide * kBlockSide);
    const auto part = [](int pixel) {
        return static_cast<std::uint32_t>(std::clamp(pixel, 0, int{kBlockSide} - 1));
    };
    std::uint32_t beyond = 0;
    for (std::size_t l = 0; l < kBlockRays; l += kLanes)
        beyond |= bits_of(splat(q) >= load(packet.q_lower + block * kBlockRays + l)) << l;
    // Columns of rays are four bits each, one after the other; rows every fourth bit.
    const std::uint32_t columns = 0xFFFFu << kBlockSide * part(pixels.first_x - x) &
                                  0xFFFFu >> kBlockSide * (3 - part(pixels.last_x - x));
    const std::uint32_t rows =
        0xFu << part(pixels.first_y - y) & 0xFu >> (3 - part(pixels.last_y - y));
    return beyond & columns & rows * 0x1111u;
}

/// Adds rays of a block, at least one, to the pixels of a rectangle.
HWY_INLINE void add_rays(std::uint32_t block, std::uint32_t rays, PixelRectangle& pixels) {
    const std::uint32_t x = block % kGridSide * kBlockSide;
    const std::uint32_t y = block / kGridSide * kBlockSide;
    const std::uint32_t rows = (rays | rays >> 4 | rays >> 8 | rays >> 12) & 0xF;
    const auto first_bit = [](std::uint32_t bits) { return std::uint32_t(__builtin_ctz(bits)); };
    const auto last_bit = [](std::uint32_t bits) {
        return 31 - std::uint32_t(__builtin_clz(bits));
    };
    const auto pixel = [](std::uint32_t place) { return static_cast<std::uint8_t>(place); };
    pixels.first_x = std::min(pixels.first_x, pixel(x + first_bit(rays) / kBlockSide));
    pixels.last_x = std::max(pixels.last_x, pixel(x + last_bit(rays) / kBlockSide));
    pixels.first_y = std::min(pixels.first_y, pixel(y + first_bit(rows)));
    pixels.last_y = std::max(pixels.last_y, pixel(y + last_bit(rows)));
}

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif
