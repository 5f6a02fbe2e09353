// The end of a closest-hit packet: t, u and v of each winner by the hit rule, for many rays at
// once.

#if defined(MORPHRAY_PACKET_FINISH_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_PACKET_FINISH_INL_H
#undef MORPHRAY_PACKET_FINISH_INL_H
#else
#define MORPHRAY_PACKET_FINISH_INL_H
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cstring>

#include "cpu/packet.h"
#include "cpu/packet_rule-inl.h"
#include "cpu/rule_vectors-inl.h"

HWY_BEFORE_NAMESPACE();
namespace morphray::cpu {
namespace HWY_NAMESPACE {

/// Winners as vectors: corners relative to the origin, rotated for the packet's axis; and ids.
struct WinnerLanes {
    VF corners[3][3];
    VW prim_ids;
};

/// Looks up values of a leaf's sixteen triangles, a slot a lane.
class SlotLookup {
public:
    HWY_INLINE explicit SlotLookup(VW slots) : slots_(slots) {}

    HWY_INLINE VF operator()(const float* values) const {
        const Floats f;
        constexpr std::uint32_t kLanes = hn::MaxLanes(Floats());
        if constexpr (kLanes == kLeafTriangles) {
            return hn::TableLookupLanes(hn::Load(f, values), hn::IndicesFromVec(f, slots_));
        } else if constexpr (2 * kLanes == kLeafTriangles) {
            const VW last = hn::Set(Words(), kLanes - 1);
            const auto index = hn::IndicesFromVec(f, hn::And(slots_, last));
            const VF low = hn::TableLookupLanes(hn::Load(f, values), index);
            const VF high = hn::TableLookupLanes(hn::Load(f, values + kLanes), index);
            return hn::IfThenElse(hn::RebindMask(f, hn::Gt(slots_, last)), high, low);
        } else {
            return hn::GatherIndex(f, values, hn::BitCast(hn::RebindToSigned<Floats>(), slots_));
        }
    }

private:
    VW slots_;
};

/// The winners of consecutive rays. lanes: the rays that have one, at least one. Neighbours have
/// winners of the same leaves, so these are taken in turn: faster than gathers.
HWY_INLINE WinnerLanes spread_winners(const Packet& packet, const std::uint32_t* indices,
                                      std::uint32_t lanes) {
    const Floats f;
    const Words words;
    const VW winners = hn::Load(words, indices);
    const VW leaves = hn::ShiftRight<4>(winners);
    const SlotLookup slots(hn::And(winners, hn::Set(words, 15u)));
    WinnerLanes out;
    std::uint32_t leaf = indices[__builtin_ctz(lanes)] / kLeafTriangles;
    const WonLeaf* won = &packet.won_leaves[leaf];
    // Lanes without a winner get some triangle as well.
    for (int k = 0; k < 3; ++k) {
        for (int axis = 0; axis < 3; ++axis) out.corners[k][axis] = slots(won->corner[k][axis]);
    }
    out.prim_ids = hn::BitCast(words, slots(won->prim_id));
    for (;;) {
        lanes &= ~mask_bits(hn::RebindMask(f, hn::Eq(leaves, hn::Set(words, leaf))));
        if (lanes == 0) return out;
        leaf = indices[__builtin_ctz(lanes)] / kLeafTriangles;
        won = &packet.won_leaves[leaf];
        const Mask own = hn::RebindMask(f, hn::Eq(leaves, hn::Set(words, leaf)));
        for (int k = 0; k < 3; ++k) {
            for (int axis = 0; axis < 3; ++axis) {
                out.corners[k][axis] =
                    hn::IfThenElse(own, slots(won->corner[k][axis]), out.corners[k][axis]);
            }
        }
        out.prim_ids = hn::IfThenElse(hn::RebindMask(words, own),
                                      hn::BitCast(words, slots(won->prim_id)), out.prim_ids);
    }
}

/// Hits as vectors.
struct HitLanes {
    VF t, u, v;
    VW prim_ids;
};

HWY_INLINE HitLanes no_hits() {
    const VF none = hn::Zero(Floats());
    return {none, none, none, hn::Set(Words(), kNoPrim)};
}

/// The hits of those of some rays from `first` on that the rule's plain path suffices for; the
/// others get none and stay in `lanes`.
HWY_INLINE HitLanes finish_fast(const Packet& packet, std::size_t first, std::uint32_t& lanes) {
    const Floats f;
    const WinnerLanes winners = spread_winners(packet, packet.winner + first, lanes);
    const std::uint32_t z = packet.frame.axis;
    const VF dir[3] = {hn::Load(f, packet.dir[(z + 1) % 3] + first),
                       hn::Load(f, packet.dir[(z + 2) % 3] + first),
                       hn::Load(f, packet.dir[z] + first)};
    VF t, u, v;
    const VF slack = splat(0.25f * packet.frame.depth_error);
    const Mask sufficed = hit_fast(dir, slack, winners.corners, t, u, v);
    const Mask done = hn::And(sufficed, mask_of(lanes));
    lanes &= ~mask_bits(done);
    return {
        hn::IfThenElseZero(done, t), hn::IfThenElseZero(done, u), hn::IfThenElseZero(done, v),
        hn::IfThenElse(hn::RebindMask(Words(), done), winners.prim_ids, hn::Set(Words(), kNoPrim))};
}

/// Where the hit of ray r of a packet goes among rows of the packet's square.
HWY_INLINE std::size_t place_in_rows(std::size_t r, std::size_t stride) {
    const std::size_t block = r / kBlockRays;
    const std::size_t x = block % kBlocksPerSide * kBlockSide + r % kBlockSide;
    const std::size_t y = block / kBlocksPerSide * kBlockSide + r % kBlockRays / kBlockSide;
    return y * stride + x;
}

/// Sets the hits of some rays from `first` on, in rows, by the whole rule.
HWY_NOINLINE void finish_exactly(const Packet& packet, std::size_t first, std::uint32_t lanes,
                                 Hit* rows, std::size_t stride) {
    const TriangleLanes winners = winning_triangles(packet, first, lanes, nullptr);
    RuleHits hit;
    PacketRule(packet, first).intersect(winners, splat(kInfiniteT), lanes, hit);
    Hit all[hn::MaxLanes(Floats())];
    hn::StoreInterleaved4(hit.t, hit.u, hit.v, hn::BitCast(Floats(), winners.prim_ids), Floats(),
                          &all->t);
    for (; lanes != 0; lanes &= lanes - 1) {
        const auto lane = static_cast<std::uint32_t>(__builtin_ctz(lanes));
        rows[place_in_rows(first + lane, stride)] = all[lane];
    }
}

/// The hits of as many consecutive rays as there are lanes, from `first` on, into rows.
HWY_INLINE void finish_rays(const Packet& packet, std::size_t first, Hit* rows,
                            std::size_t stride) {
    const Floats f;
    const Words words;
    constexpr std::size_t kLanes = hn::MaxLanes(Floats());
    constexpr std::size_t kPart = std::min<std::size_t>(kLanes, kBlockSide);
    const VW winners = hn::Load(words, packet.winner + first);
    std::uint32_t left = mask_bits(hn::RebindMask(f, hn::Ne(winners, hn::Set(words, kNoWinner))));
    const HitLanes lanes = left != 0 && HWY_LIKELY(packet.frame.axis != kMixedAxes)
                               ? finish_fast(packet, first, left)
                               : no_hits();
    alignas(64) Hit hits[kLanes];
    hn::StoreInterleaved4(lanes.t, lanes.u, lanes.v, hn::BitCast(f, lanes.prim_ids), f, &hits->t);
    for (std::size_t l = 0; l < kLanes; l += kPart)
        std::memcpy(rows + place_in_rows(first + l, stride), hits + l, kPart * sizeof(Hit));
    if (HWY_UNLIKELY(left != 0)) finish_exactly(packet, first, left, rows, stride);
}

}  // namespace HWY_NAMESPACE
}  // namespace morphray::cpu
HWY_AFTER_NAMESPACE();

#endif
