// The pixels of a part of an image in blocks of 4 x 4: their hits, and what is written for them.
#if defined(MORPHRAY_CPU_IMAGE_PIXEL_BLOCKS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_IMAGE_PIXEL_BLOCKS_INL_H
#undef MORPHRAY_CPU_IMAGE_PIXEL_BLOCKS_INL_H
#else
#define MORPHRAY_CPU_IMAGE_PIXEL_BLOCKS_INL_H
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "cpu/image/pixel_shader.h"
#include "cpu/image/shown_triangles-inl.h"
#include "cpu/simd/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

/// A block's pixels are in the order of the rays of a light packet: column by column.
constexpr std::uint32_t kColumnShift = 2;
constexpr std::uint32_t kRowMask = kBlockSide - 1;
static_assert(kBlockSide == 1u << kColumnShift);

/// Some pixels of a block, one a lane.
struct PixelLanes {
    UintVec x, y;
    /// Whether the pixel is in the part and has a hit.
    Mask visible;
    /// prim is 0 and t undefined where the pixel is not visible.
    UintVec prim;
    FloatVec t;
};

/// A block of a part, of which only the first columns and rows may be in the part.
struct PixelBlock {
    std::uint32_t x, y;
    std::uint32_t columns, rows;

    std::size_t begin(const PixelPart& part) const {
        return std::size_t{y} * part.params.width + x;
    }
    /// The index of the block's first pixel in a light packet.
    std::uint32_t ray_index(const PixelPart& part) const {
        return light_packet_ray(x - part.tile.x0, y - part.tile.y0);
    }
};

constexpr std::uint32_t kStripSide = ShownTriangles::kMostPixels / kBlockSide;

template <class Visit>
HWY_INLINE void for_each_strip(const Tile& tile, Visit visit) {
    Tile strip;
    for (strip.y0 = tile.y0; strip.y0 < tile.y1; strip.y0 += kBlockSide) {
        strip.y1 = std::min(strip.y0 + kBlockSide, tile.y1);
        for (strip.x0 = tile.x0; strip.x0 < tile.x1; strip.x0 += kStripSide) {
            strip.x1 = std::min(strip.x0 + kStripSide, tile.x1);
            visit(strip);
        }
    }
}

template <class Visit>
HWY_INLINE void for_each_block(const Tile& tile, Visit visit) {
    for (std::uint32_t y = tile.y0; y < tile.y1; y += kBlockSide) {
        for (std::uint32_t x = tile.x0; x < tile.x1; x += kBlockSide) {
            visit(PixelBlock{x, y, std::min(kBlockSide, tile.x1 - x),
                             std::min(kBlockSide, tile.y1 - y)});
        }
    }
}

/// Loads t and prim_id of the pixels of a block in these columns and rows, one a lane.
HWY_INLINE void load_hits(const PixelPart& part, const PixelBlock& block, std::uint32_t first,
                          UintVec column, UintVec row, FloatVec& t, UintVec& prim) {
    static_assert(sizeof(Hit) == 4 * sizeof(float));
    const float* const hits = &part.frame.hits[block.begin(part)].t;
#if HWY_TARGET != HWY_SCALAR
    if (HWY_LIKELY(block.columns == kBlockSide && block.rows == kBlockSide)) {
        FloatVec in[4], words[4];
        for (std::size_t j = 0; j < 4; ++j)
            in[j] = load_unaligned(hits + 4 * (j * part.params.width + first / kBlockSide));
        transpose_fours(kFloats, in, words);
        t = words[0];
        prim = as_uint(words[3]);
        return;
    }
#else
    (void)first;
#endif
    const UintVec pixel = row * splat(part.params.width) + column;
    const auto at = as_int(shift_left<2>(pixel));
    t = hn::GatherIndex(kFloats, hits, at);
    prim = as_uint(hn::GatherIndex(kFloats, hits, at + splat(3)));
}

HWY_INLINE PixelLanes load_pixels(const PixelPart& part, const PixelBlock& block,
                                  std::uint32_t first) {
    const UintVec lane = hn::Iota(kUints, first);
    const UintVec column = shift_right<kColumnShift>(lane);
    const UintVec row = lane & splat(kRowMask);
    PixelLanes pixels;
    pixels.x = column + splat(block.x);
    pixels.y = row + splat(block.y);
    // Pixels outside the part are read from its last column or row.
    const UintVec in_column = min(column, splat(block.columns - 1));
    const UintVec in_row = min(row, splat(block.rows - 1));
    UintVec prim;
    load_hits(part, block, first, in_column, in_row, pixels.t, prim);
    const auto is_there = (in_column == column) & (in_row == row);
    const auto is_visible = is_there & (prim != splat(kNoPrim));
    pixels.visible = float_mask(is_visible);
    pixels.prim = zero_unless(is_visible, prim);
    return pixels;
}

/// Values of the pixels of a strip, row by row.
class StripRows {
public:
    /// Sets those of a block, which come column by column.
    HWY_INLINE void set(const Tile& strip, const PixelBlock& block, const std::uint32_t* from) {
        std::uint32_t* const to = rows_[0] + (block.x - strip.x0);
#if HWY_TARGET != HWY_SCALAR
        const hn::CappedTag<std::uint32_t, kBlockSide> four;
        hn::Vec<decltype(four)> columns[kBlockSide], rows[kBlockSide];
        for (std::uint32_t i = 0; i < kBlockSide; ++i)
            columns[i] = hn::Load(four, from + i * kBlockSide);
        transpose_fours(four, columns, rows);
        for (std::uint32_t i = 0; i < kBlockSide; ++i)
            hn::Store(rows[i], four, to + i * kStripSide);
#else
        for (std::uint32_t i = 0; i < kBlockRays; ++i)
            to[(i & kRowMask) * kStripSide + (i >> kColumnShift)] = from[i];
#endif
    }

    /// Writes them to an image. Whole cache lines go past the caches, so that they are not read
    /// before they are overwritten (lab/notes/cpu_tracer.md).
    void write(const Tile& strip, std::uint32_t width, std::uint32_t* image) const {
        std::uint32_t* to = image + std::size_t{strip.y0} * width + strip.x0;
        const std::uint32_t count = strip.x1 - strip.x0;
        for (std::uint32_t i = 0; i < strip.y1 - strip.y0; ++i, to += width) {
            const bool is_aligned = reinterpret_cast<std::uintptr_t>(to) % kCacheLine == 0;
            if (!is_aligned || count % kLanes != 0) {
                std::copy_n(rows_[i], count, to);
                continue;
            }
            for (std::uint32_t x = 0; x < count; x += kLanes)
                hn::Stream(hn::Load(kUints, rows_[i] + x), kUints, to + x);
        }
    }

private:
    alignas(kCacheLine) std::uint32_t rows_[kBlockSide][kStripSide];
};

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif  // per target
