// The blocks and quads of a light packet that a rectangle of its plane or a depth concerns, and
// their rays as vectors.

#if defined(MORPHRAY_CPU_PACKET_LIGHT_LIGHT_PACKET_BLOCKS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_PACKET_LIGHT_LIGHT_PACKET_BLOCKS_INL_H
#undef MORPHRAY_CPU_PACKET_LIGHT_LIGHT_PACKET_BLOCKS_INL_H
#else
#define MORPHRAY_CPU_PACKET_LIGHT_LIGHT_PACKET_BLOCKS_INL_H
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "cpu/packet/light/light_packet.h"
#include "cpu/packet/packet_frame-inl.h"
#include "cpu/simd/fast_hit_rule-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {

/// The blocks of a group with rays that may lie in a rectangle (lower x, upper x, lower y, upper y)
/// and that a hit at 1/z <= q may concern, as bits.
HWY_INLINE std::uint32_t blocks_in(const LightPacket& packet, const float rectangle[4], float q,
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

/// Quads of a packet as bits: the first word has those in place, the second those of regrouped
/// blocks.
struct QuadSet {
    std::uint64_t words[2];

    HWY_INLINE bool any() const { return (words[0] | words[1]) != 0; }
};

/// The quads of `among` that rectangle i and a hit at 1/z <= q may concern.
HWY_INLINE QuadSet quads_in(const LightPacket& packet, const Rectangles& r, float q,
                            std::uint32_t i, const QuadSet& among) {
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
    if (packet.regrouped_count != 0)
        find(1, (packet.regrouped_count + kQuadBlocks - 1) / kQuadBlocks);
    return quads;
}

/// The quads of `among` with a ray that a hit at 1/z <= q may concern.
HWY_INLINE QuadSet quads_beyond(const LightPacket& packet, float q, const QuadSet& among) {
    QuadSet quads = {};
    const auto find = [&](std::uint32_t word, std::size_t count) HWY_ATTR {
        for (std::size_t l = 0; l < count; l += kLanes) {
            const Mask near = splat(q) >= load(packet.quad_q + 64 * word + l);
            quads.words[word] |= std::uint64_t{bits_of(near)} << l;
        }
        quads.words[word] &= among.words[word];
    };
    find(0, kLightPacketQuads / 2);
    if (packet.regrouped_count != 0)
        find(1, (packet.regrouped_count + kQuadBlocks - 1) / kQuadBlocks);
    return quads;
}

/// Updates block_q of a block from its rays, and quad_q of its quad.
HWY_INLINE void update_depth(LightPacket& packet, std::uint32_t block) {
    packet.block_q[block] = least_q(packet.q_lower + block * kBlockRays);
    const std::uint32_t quad = block / kQuadBlocks;
    const float* block_q = packet.block_q + quad * kQuadBlocks;
    packet.quad_q[quad] =
        std::min(std::min(block_q[0], block_q[1]), std::min(block_q[2], block_q[3]));
}

/// Loads as many rays of a block as there are lanes, from `first` on.
HWY_INLINE void load_rays(const SharedOriginRays& rays, std::size_t first, FloatVec d[3],
                          FloatVec& tfar) {
    for (int axis = 0; axis < 3; ++axis) d[axis] = load(rays.dir[axis] + first);
    tfar = load(rays.tfar + first);
}

/// The rays of a block.
HWY_INLINE const SharedOriginRays& rays_of(const LightPacket& packet, std::size_t block) {
    return block < kLightPacketBlocks ? packet.rays[block]
                                      : packet.regrouped[block - kLightPacketBlocks];
}

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif
