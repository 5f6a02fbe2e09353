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

/// Writes the hits of a packet whose rays have found their winners.
class PacketFinish {
public:
    /// rows: the packet's square, row by row.
    PacketFinish(const Packet& packet, Hit* rows, std::size_t stride)
        : packet_(packet), rows_(rows), stride_(stride) {
        const std::uint32_t z = packet.frame.axis;
        if (z == kMixedAxes) return;
        for (std::uint32_t k = 0; k < 3; ++k) dir_[k] = packet.dir[(z + 1 + k) % 3];
    }

    void run() {
        for (std::uint32_t block = 0; block < kPacketBlocks; ++block) {
            Hit* const corner = place(block);
            for (std::size_t l = 0; l < kBlockRays; l += kLanes)
                finish(block * kBlockRays + l, corner + l / kBlockSide * stride_ + l % kBlockSide);
        }
        if (HWY_UNLIKELY(left_count_ != 0)) finish_left();
    }

private:
    static constexpr std::size_t kLanes = hn::MaxLanes(Floats());
    static constexpr std::size_t kPart = std::min<std::size_t>(kLanes, kBlockSide);

    Hit* place(std::uint32_t block) const {
        return rows_ + block / kBlocksPerSide * kBlockSide * stride_ +
               block % kBlocksPerSide * kBlockSide;
    }

    /// The hits of as many consecutive rays as there are lanes, from `first` on.
    HWY_INLINE void finish(std::size_t first, Hit* out) {
        const Floats f;
        const Words words;
        const VW winners = hn::Load(words, packet_.winner + first);
        std::uint32_t left =
            mask_bits(hn::RebindMask(f, hn::Ne(winners, hn::Set(words, kNoWinner))));
        const HitLanes lanes =
            left != 0 && HWY_LIKELY(dir_[0] != nullptr) ? finish_fast(first, left) : no_hits();
        alignas(64) Hit hits[kLanes];
        hn::StoreInterleaved4(lanes.t, lanes.u, lanes.v, hn::BitCast(f, lanes.prim_ids), f,
                              &hits->t);
        for (std::size_t l = 0; l < kLanes; l += kPart)
            std::memcpy(out + l / kBlockSide * stride_, hits + l, kPart * sizeof(Hit));
        for (; left != 0; left &= left - 1) {
            left_[left_count_++] =
                static_cast<std::uint16_t>(first + static_cast<std::size_t>(__builtin_ctz(left)));
        }
    }

    /// The hits of those of some rays from `first` on that the rule's plain path suffices for; the
    /// others get none and stay in `lanes`.
    HWY_INLINE HitLanes finish_fast(std::size_t first, std::uint32_t& lanes) const {
        const Floats f;
        const Words words;
        const WinnerLanes winners = spread_winners(packet_, packet_.winner + first, lanes);
        const VF dir[3] = {hn::Load(f, dir_[0] + first), hn::Load(f, dir_[1] + first),
                           hn::Load(f, dir_[2] + first)};
        const VF slack = splat(0.25f * packet_.frame.depth_error);
        VF t, u, v;
        const Mask sufficed = hit_fast(dir, slack, winners.corners, t, u, v);
        const Mask done = hn::And(sufficed, mask_of(lanes));
        lanes &= ~mask_bits(done);
        return {
            hn::IfThenElseZero(done, t), hn::IfThenElseZero(done, u), hn::IfThenElseZero(done, v),
            hn::IfThenElse(hn::RebindMask(words, done), winners.prim_ids, hn::Set(words, kNoPrim))};
    }

    /// The hits that are left, by the whole rule.
    HWY_NOINLINE void finish_left() const {
        const Floats f;
        for (std::size_t i = 0; i < left_count_; i += kLanes) {
            const std::size_t count = std::min(kLanes, left_count_ - i);
            alignas(64) float dir[3][kLanes] = {};
            alignas(64) std::uint32_t winners[kLanes] = {};
            for (std::size_t l = 0; l < count; ++l) {
                const std::size_t r = left_[i + l];
                for (int axis = 0; axis < 3; ++axis) dir[axis][l] = packet_.dir[axis][r];
                winners[l] = packet_.winner[r];
            }
            const auto lanes = static_cast<std::uint32_t>((std::uint64_t{1} << count) - 1);
            const TriangleLanes triangles = winning_triangles(packet_, winners, lanes, nullptr);
            RuleHits hit;
            PacketRule(packet_.frame.org,
                       {hn::Load(f, dir[0]), hn::Load(f, dir[1]), hn::Load(f, dir[2])})
                .intersect(triangles, splat(kInfiniteT), lanes, hit);
            Hit hits[kLanes];
            hn::StoreInterleaved4(hit.t, hit.u, hit.v, hn::BitCast(f, triangles.prim_ids), f,
                                  &hits->t);
            for (std::size_t l = 0; l < count; ++l) {
                const std::size_t r = left_[i + l];
                const std::size_t in_block = r % kBlockRays;
                place(static_cast<std::uint32_t>(
                    r / kBlockRays))[in_block / kBlockSide * stride_ + in_block % kBlockSide] =
                    hits[l];
            }
        }
    }

    const Packet& packet_;
    Hit* rows_;
    std::size_t stride_;
    /// Of the rays, rotated for the packet's axis; null where it has none.
    const float* dir_[3] = {};
    /// The rays that the plain path does not suffice for.
    std::uint16_t left_[kPacketRays];
    std::size_t left_count_ = 0;
};

}  // namespace HWY_NAMESPACE
}  // namespace morphray::cpu
HWY_AFTER_NAMESPACE();

#endif
