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
#include "cpu/simd/hit_rule-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {

/// The blocks of a group with rays that may lie in a rectangle and that a hit at 1/z <= q may
/// concern, as bits.
HWY_INLINE std::uint32_t blocks_in(const LightPacket& packet, const RectangleLanes& rectangle,
                                   float q, std::uint32_t group) {
    std::uint32_t blocks = 0;
    for (std::size_t l = 0; l < kGroupBlocks; l += kLanes) {
        const std::size_t b = group * kGroupBlocks + l;
        const Mask near = splat(q) >= load(packet.block_q + b);
        blocks |= bits_of(near & rectangle.meets(RectangleLanes(packet.blocks, b))) << l;
    }
    return blocks;
}

/// Quads of a packet as bits: the first word has those in place, the second those of regrouped
/// blocks.
struct QuadSet {
    std::uint64_t words[2];

    HWY_INLINE bool any() const { return (words[0] | words[1]) != 0; }
    HWY_INLINE std::size_t count() const {
        return hwy::PopCount(words[0]) + hwy::PopCount(words[1]);
    }
};

/// With more quads than this in reach of a box, asking each quad, and its rays, about the box costs
/// more than it saves (lab/notes/cpu_tracer.md).
inline constexpr std::size_t kFewQuads = 8;

/// The quads of `among` for which is_met(k) has a lane: it tests as many as there are lanes, from
/// k on.
template <class IsMet>
HWY_INLINE QuadSet find_quads(const LightPacket& packet, const QuadSet& among, IsMet is_met) {
    QuadSet quads = {};
    const auto find = [&](std::uint32_t word, std::size_t count) HWY_ATTR {
        for (std::size_t l = 0; l < count; l += kLanes)
            quads.words[word] |= std::uint64_t{bits_of(is_met(64 * word + l))} << l;
        quads.words[word] &= among.words[word];
    };
    find(0, kLightPacketQuads / 2);
    if (packet.regrouped_count != 0)
        find(1, (packet.regrouped_count + kQuadBlocks - 1) / kQuadBlocks);
    return quads;
}

/// The quads of `among` that a rectangle and a hit at 1/z <= q may concern.
HWY_INLINE QuadSet quads_in(const LightPacket& packet, const RectangleLanes& rectangle, float q,
                            const QuadSet& among) {
    return find_quads(packet, among, [&](std::size_t k) HWY_ATTR {
        const Mask near = splat(q) >= load(packet.quad_q + k);
        return near & rectangle.meets(RectangleLanes(packet.quads, k));
    });
}

/// Sets quads_of[slot] to the quads of `among` that rectangle `slot` and a hit at 1/z <= q[slot]
/// may concern, for the slots of `slots`. Returns the slots that have some. For few quads: each is
/// compared with all rectangles at once.
HWY_INLINE std::uint32_t few_quads_in(const LightPacket& packet, const Rectangles& r,
                                      const float* q, std::uint32_t slots, const QuadSet& among,
                                      QuadSet* quads_of) {
    for (std::uint32_t rest = slots; rest != 0; rest &= rest - 1)
        quads_of[__builtin_ctz(rest)] = {};
    std::uint32_t kept = 0;
    for (std::uint32_t word = 0; word < 2; ++word) {
        for (std::uint64_t rest = among.words[word]; rest != 0; rest &= rest - 1) {
            const std::size_t k = 64 * word + static_cast<std::uint32_t>(__builtin_ctzll(rest));
            const RectangleLanes quad(packet.quads[k]);
            const FloatVec quad_q = splat(packet.quad_q[k]);
            std::uint32_t met = 0;
            for (std::size_t l = 0; l < kWidth; l += kLanes) {
                const Mask near = load(q + l) >= quad_q;
                met |= bits_of(near & RectangleLanes(r, l).meets(quad)) << l;
            }
            met &= slots;
            kept |= met;
            for (; met != 0; met &= met - 1)
                quads_of[__builtin_ctz(met)].words[word] |= rest & -rest;
        }
    }
    return kept;
}

/// The quads of `among` with a ray that a hit at 1/z <= q may concern.
HWY_INLINE QuadSet quads_beyond(const LightPacket& packet, float q, const QuadSet& among) {
    return find_quads(packet, among,
                      [&](std::size_t k) HWY_ATTR { return splat(q) >= load(packet.quad_q + k); });
}

/// A packet is given up if its quads cover their bounds more often than this
/// (lab/notes/cpu_tracer.md).
inline constexpr float kMostOverlap = 8;

/// Whether quads lie over each other, so that most boxes concern many of them but few rays: the
/// areas of all quads are more than kMostOverlap times that of their bounds.
HWY_INLINE bool quads_overlap(const LightPacket& packet) {
    FloatVec area = zero();
    for (std::size_t k = 0; k < kLightPacketQuads; k += kLanes) {
        const Mask has_rays = load(packet.quad_q + k) < splat(kDone);
        const RectangleLanes quad(packet.quads, k);
        const FloatVec width = quad.upper_x - quad.lower_x;
        const FloatVec height = quad.upper_y - quad.lower_y;
        area = area + zero_unless(has_rays, width * height);
    }
    const PacketFrame& frame = packet.frame;
    return hn::GetLane(hn::SumOfLanes(kFloats, area)) >
           kMostOverlap * (frame.upper_x - frame.lower_x) * (frame.upper_y - frame.lower_y);
}

/// The rays that lie in a rectangle and that a hit at 1/z <= q may concern.
class RaysWithin {
public:
    HWY_INLINE RaysWithin(const LightPacket& packet, const PlaneRectangle& rectangle, float q)
        : packet_(packet), rectangle_(rectangle), q_(splat(q)) {}

    /// Whether a block has any.
    HWY_INLINE bool any_of_block(std::size_t block) const {
        Mask found = at(block * kBlockRays);
        for (std::size_t l = kLanes; l < kBlockRays; l += kLanes)
            found = found | at(block * kBlockRays + l);
        return !none(found);
    }

    /// The quads of `among` that have some.
    HWY_INLINE QuadSet quads(const QuadSet& among) const {
        QuadSet kept = {};
        for (std::uint32_t word = 0; word < 2; ++word) {
            for (std::uint64_t rest = among.words[word]; rest != 0; rest &= rest - 1) {
                const std::size_t first =
                    (64 * word + static_cast<std::uint32_t>(__builtin_ctzll(rest))) * kQuadBlocks;
                if (any_of_block(first) || any_of_block(first + 1) || any_of_block(first + 2) ||
                    any_of_block(first + 3))
                    kept.words[word] |= rest & -rest;
            }
        }
        return kept;
    }

private:
    /// Asks as many rays as there are lanes, from r on.
    HWY_INLINE Mask at(std::size_t r) const {
        return (load(packet_.q_lower + r) <= q_) &
               rectangle_.holds(load(packet_.x + r), load(packet_.y + r));
    }

    const LightPacket& packet_;
    RectangleLanes rectangle_;
    FloatVec q_;
};

/// Updates quad_q of a quad from its blocks.
HWY_INLINE void update_quad_depth(LightPacket& packet, std::uint32_t quad) {
    const float* block_q = packet.block_q + quad * kQuadBlocks;
    packet.quad_q[quad] =
        std::min(std::min(block_q[0], block_q[1]), std::min(block_q[2], block_q[3]));
}

/// Updates block_q of a block from its rays, and quad_q of its quad.
HWY_INLINE void update_depth(LightPacket& packet, std::uint32_t block) {
    packet.block_q[block] = least_q(packet.q_lower + block * kBlockRays);
    update_quad_depth(packet, block / kQuadBlocks);
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
