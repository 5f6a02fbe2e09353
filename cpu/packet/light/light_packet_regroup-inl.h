// Finds the rays of a light packet that are neighbours. Where a surface ends in the image, the rays
// of one block are far apart, and are regrouped.

#if defined(MORPHRAY_CPU_PACKET_LIGHT_LIGHT_PACKET_REGROUP_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_PACKET_LIGHT_LIGHT_PACKET_REGROUP_INL_H
#undef MORPHRAY_CPU_PACKET_LIGHT_LIGHT_PACKET_REGROUP_INL_H
#else
#define MORPHRAY_CPU_PACKET_LIGHT_LIGHT_PACKET_REGROUP_INL_H
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>

#include "cpu/packet/light/light_packet.h"
#include "cpu/packet/packet_frame-inl.h"
#include "cpu/simd/hit_rule-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {

/// Blocks of a light packet, those of each group as bits.
struct LightPacketBlocks {
    std::uint32_t of_group[kLightPacketGroups];
};

HWY_INLINE bool has_block(const LightPacketBlocks& blocks, std::uint32_t block) {
    return (blocks.of_group[block / kGroupBlocks] >> block % kGroupBlocks & 1) != 0;
}

/// Calls visit(block) for each block.
template <class Visit>
HWY_INLINE void for_each_block(const LightPacketBlocks& blocks, Visit visit) {
    for (std::uint32_t group = 0; group < kLightPacketGroups; ++group) {
        for (std::uint32_t own = blocks.of_group[group]; own != 0; own &= own - 1)
            visit(group * kGroupBlocks + static_cast<std::uint32_t>(__builtin_ctz(own)));
    }
}

/// The median of `used` positive numbers among `size`, the others being infinite: the least number
/// with no more than half of them below it, or up to an eighth less. It is found bit by bit, which
/// takes less time than sorting (lab/notes/cpu_tracer.md).
HWY_INLINE float median_of_blocks(const float* values, std::size_t size, std::size_t used) {
    constexpr int kHighest = 30, kLowest = 20;  // the exponent and 3 bits of the mantissa
    std::uint32_t median = 0;
    for (int bit = kHighest; bit >= kLowest; --bit) {
        const std::uint32_t trial = median | std::uint32_t{1} << bit;
        const FloatVec bound = splat(std::bit_cast<float>(trial));
        std::size_t below = 0;
        for (std::size_t b = 0; b < size; b += kLanes) below += count(load(values + b) < bound);
        if (below <= used / 2) median = trial;
    }
    return std::bit_cast<float>(median);
}

/// How far the active rays of each block spread in x and y together; infinite without any.
struct Spreads {
    alignas(64) float of_block[kAllLightPacketBlocks];
    std::size_t used = 0;  // blocks with active rays
};

/// Sets the spreads of blocks [first, end), which are whole groups.
HWY_INLINE void measure_spreads(const LightPacket& packet, std::uint32_t first, std::uint32_t end,
                                Spreads& spreads) {
    spreads.used = 0;
    for (std::size_t b = first; b < end; b += kLanes) {
        const RectangleLanes r(packet.blocks, b);
        const FloatVec own = r.upper_x - r.lower_x + (r.upper_y - r.lower_y);
        const Mask is_used = own >= zero();
        spreads.used += count(is_used);
        store(select(is_used, own, splat(kDone)), spreads.of_block + b);
    }
}

/// Adds to `wide` the blocks of [first, end), whole groups, whose rays spread farther than `width`.
/// Returns how many they are.
HWY_INLINE std::size_t blocks_wider(const Spreads& spreads, std::uint32_t first, std::uint32_t end,
                                    float width, LightPacketBlocks& wide) {
    std::size_t blocks = 0;
    for (std::size_t b = first; b < end; b += kLanes) {
        const FloatVec own = load(spreads.of_block + b);
        const Mask wider = (own > splat(width)) & (own < splat(kDone));
        wide.of_group[b / kGroupBlocks] |= bits_of(wider) << b % kGroupBlocks;
        blocks += count(wider);
    }
    return blocks;
}

/// Square cells of the plane, numbered in Morton order.
struct Cells {
    static constexpr std::uint32_t kPerSide = 16;
    static constexpr std::uint32_t kCount = kPerSide * kPerSide;

    float lower_x, lower_y;
    float scale_x, scale_y;

    /// The cells of points; the nearest cells of points outside.
    HWY_INLINE UintVec of(FloatVec x, FloatVec y) const {
        // Spreads the bits of a number to every other place.
        const auto spread = [](UintVec v) HWY_ATTR {
            v = (v | shift_left<2>(v)) & splat(0x33u);
            return (v | shift_left<1>(v)) & splat(0x55u);
        };
        const auto number = [](FloatVec v) HWY_ATTR {
            const FloatVec inside = min(max(v, zero()), splat(static_cast<float>(kPerSide - 1)));
            return as_uint(hn::ConvertTo(kInts, inside));
        };
        const UintVec column = number((x - splat(lower_x)) * splat(scale_x));
        const UintVec row = number((y - splat(lower_y)) * splat(scale_y));
        return spread(column) | shift_left<1>(spread(row));
    }
};

/// A cell's extent is at least this over kPerSide, so that no scale overflows.
inline constexpr float kLeastExtent = 1e-20f;

/// The cells around the active rays of some blocks.
HWY_INLINE Cells cells_around(const LightPacket& packet, const LightPacketBlocks& blocks) {
    PlaneRectangle r = PlaneRectangle::none();
    for_each_block(blocks, [&](std::uint32_t block) { r.add(packet.blocks[block]); });
    constexpr float kSide = Cells::kPerSide;
    return {r.lower_x, r.lower_y, kSide / std::max(r.upper_x - r.lower_x, kLeastExtent),
            kSide / std::max(r.upper_y - r.lower_y, kLeastExtent)};
}

/// Active rays of a packet in the order of keys below kKeys.
template <std::uint32_t kKeys>
struct RayOrder {
    std::uint16_t rays[kLightPacketRays];
    /// Where the rays of each key end in `rays`.
    std::uint16_t end[kKeys + 1] = {};

    std::span<const std::uint16_t> of_keys(std::uint32_t first, std::uint32_t after) const {
        const std::uint32_t begin = first == 0 ? 0 : end[first - 1];
        return std::span(rays).subspan(begin, end[after - 1] - begin);
    }
};

/// Sorts the active rays of some blocks by key_of(r): the keys of as many rays as there are lanes,
/// from r on.
template <std::uint32_t kKeys, class KeyOf>
HWY_INLINE void sort_rays(const SharedOriginRays* all, const LightPacketBlocks& blocks,
                          KeyOf key_of, RayOrder<kKeys>& order) {
    std::uint16_t rays[kLightPacketRays], keys[kLightPacketRays];
    // Counted one place higher, the place of the next ray of each key: in the end, where they end.
    std::uint16_t* const next = order.end;
    std::size_t count = 0;
    for_each_block(blocks, [&](std::uint32_t block) HWY_ATTR {
        const std::uint32_t first = block * kBlockRays;
        for (std::uint32_t r = first; r < first + kBlockRays; r += kLanes) {
            alignas(64) std::uint32_t own[kLanes];
            store(key_of(r), own);
            for (std::uint32_t l = 0; l < kLanes; ++l) {
                const bool is_active = all[block].has(r - first + l);
                rays[count] = static_cast<std::uint16_t>(r + l);
                keys[count] = static_cast<std::uint16_t>(own[l]);
                next[own[l] + 1] = static_cast<std::uint16_t>(next[own[l] + 1] + is_active);
                count += is_active;
            }
        }
    });
    for (std::uint32_t key = 1; key < kKeys; ++key)
        next[key] = static_cast<std::uint16_t>(next[key] + next[key - 1]);
    for (std::size_t i = 0; i < count; ++i) order.rays[next[keys[i]]++] = rays[i];
}

/// Makes all rays of some blocks inactive.
HWY_INLINE void deactivate_blocks(LightPacket& packet, const LightPacketBlocks& blocks) {
    for_each_block(blocks, [&](std::uint32_t block) {
        packet.blocks.set(block, PlaneRectangle::none());
        packet.block_q[block] = kDone;
    });
}

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif
