// The end of a closest-hit packet: t, u and v of each winner by the hit rule, for many rays at
// once.

#if defined(MORPHRAY_PACKET_FINISH_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_PACKET_FINISH_INL_H
#undef MORPHRAY_PACKET_FINISH_INL_H
#else
#define MORPHRAY_PACKET_FINISH_INL_H
#endif

#include <hwy/highway.h>

#include "cpu/packet.h"
#include "cpu/rule_vectors-inl.h"

HWY_BEFORE_NAMESPACE();
namespace morphray::cpu {
namespace HWY_NAMESPACE {

/// Winners as vectors: corners relative to the origin, rotated unless the axes are mixed; and ids.
struct WinnerLanes {
    VF corners[3][3];
    VW prim_ids;
};

/// The winners of consecutive rays. lanes: the rays that have one, at least one. Neighbours share
/// winners, so each is spread over its lanes in turn: faster than gathers.
HWY_INLINE WinnerLanes spread_winners(const Packet& packet, const std::uint32_t* indices,
                                      std::uint32_t lanes) {
    const Words words;
    const VW winners = hn::Load(words, indices);
    WinnerLanes out;
    // Lanes without a winner get the first as well.
    std::uint32_t index = indices[__builtin_ctz(lanes)];
    const WonLeaf* won = &packet.won_leaves[index / kLeafTriangles];
    std::uint32_t slot = index % kLeafTriangles;
    for (int k = 0; k < 3; ++k) {
        for (int axis = 0; axis < 3; ++axis)
            out.corners[k][axis] = splat(won->corner[k][axis][slot]);
    }
    out.prim_ids = hn::Set(words, won->leaf->prim_id[slot]);
    for (;;) {
        const auto done = hn::Eq(winners, hn::Set(words, index));
        lanes &= ~mask_bits(hn::RebindMask(Floats(), done));
        if (lanes == 0) return out;
        index = indices[__builtin_ctz(lanes)];
        won = &packet.won_leaves[index / kLeafTriangles];
        slot = index % kLeafTriangles;
        const auto own = hn::Eq(winners, hn::Set(words, index));
        for (int k = 0; k < 3; ++k) {
            for (int axis = 0; axis < 3; ++axis) {
                out.corners[k][axis] =
                    hn::IfThenElse(hn::RebindMask(Floats(), own), splat(won->corner[k][axis][slot]),
                                   out.corners[k][axis]);
            }
        }
        out.prim_ids = hn::IfThenElse(own, hn::Set(words, won->leaf->prim_id[slot]), out.prim_ids);
    }
}

/// Hits as vectors.
struct HitLanes {
    VF t, u, v;
    VW prim_ids;
};

/// Sets the hits of those of some lanes that the plain path suffices for; dir and corners rotated
/// for their axis. Which they are.
HWY_INLINE std::uint32_t finish_fast(const PacketFrame& frame, const VF dir[3],
                                     const VF corners[3][3], VW prim_ids, std::uint32_t lanes,
                                     HitLanes& hits) {
    VF t, u, v;
    Mask in_front;
    const VF slack = splat(0.25f * frame.depth_error);
    const Mask sufficed = hit_fast(dir, slack, corners, t, u, v, in_front);
    const Mask done = hn::And(sufficed, mask_of(lanes));
    hits.t = hn::IfThenElse(done, t, hits.t);
    hits.u = hn::IfThenElse(done, u, hits.u);
    hits.v = hn::IfThenElse(done, v, hits.v);
    hits.prim_ids = hn::IfThenElse(hn::RebindMask(Words(), done), prim_ids, hits.prim_ids);
    return mask_bits(done);
}

/// Likewise where the largest direction components lie on several axes: rotates.
HWY_NOINLINE std::uint32_t finish_mixed(const PacketFrame& frame, const VF dir[3],
                                        const WinnerLanes& winners, std::uint32_t lanes,
                                        HitLanes& hits) {
    std::uint32_t by_axis[3];
    lanes_by_axis(dir, lanes, by_axis);
    std::uint32_t done = 0;
    for (std::uint32_t axis = 0; axis < 3; ++axis) {
        if (by_axis[axis] == 0) continue;
        VF rotated_dir[3], rotated[3][3];
        rotate(axis, dir, rotated_dir);
        for (int k = 0; k < 3; ++k) rotate(axis, winners.corners[k], rotated[k]);
        done |= finish_fast(frame, rotated_dir, rotated, winners.prim_ids, by_axis[axis], hits);
    }
    return done;
}

/// By the rule itself.
HWY_NOINLINE Hit finish_exact(const Packet& packet, std::uint32_t r) {
    const Leaf& leaf = packet.winning_leaf(r);
    const std::uint32_t slot = packet.winning_slot(r);
    TriangleHit hit;
    intersect_slot(shear_ray(packet.frame.org, packet.direction(r)), kInfiniteT, leaf, slot, hit);
    return make_hit(hit, leaf.prim_id[slot]);
}

/// The hits of as many consecutive rays as there are lanes, from `first` on.
template <bool kMixed>
HWY_INLINE void finish_rays(const Packet& packet, std::size_t first, Hit* HWY_RESTRICT hits) {
    const Floats f;
    const Words words;
    const std::uint32_t* indices = packet.winner + first;
    std::uint32_t left =
        mask_bits(hn::RebindMask(f, hn::Ne(hn::Load(words, indices), hn::Set(words, kNoWinner))));
    HitLanes lanes = {hn::Zero(f), hn::Zero(f), hn::Zero(f), hn::Set(words, kNoPrim)};
    if (left != 0) {
        const WinnerLanes winners = spread_winners(packet, indices, left);
        // Rotated like the corners.
        const std::uint32_t z = rotation_axis(packet.frame);
        const VF dir[3] = {hn::Load(f, packet.dir[(z + 1) % 3] + first),
                           hn::Load(f, packet.dir[(z + 2) % 3] + first),
                           hn::Load(f, packet.dir[z] + first)};
        left &= ~(kMixed ? finish_mixed(packet.frame, dir, winners, left, lanes)
                         : finish_fast(packet.frame, dir, winners.corners, winners.prim_ids, left,
                                       lanes));
    }
    hn::StoreInterleaved4(lanes.t, lanes.u, lanes.v, hn::BitCast(f, lanes.prim_ids), f, &hits->t);
    for (; left != 0; left &= left - 1) {
        const auto i = static_cast<std::uint32_t>(__builtin_ctz(left));
        hits[i] = finish_exact(packet, static_cast<std::uint32_t>(first) + i);
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace morphray::cpu
HWY_AFTER_NAMESPACE();

#endif
