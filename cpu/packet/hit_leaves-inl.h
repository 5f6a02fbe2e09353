// The candidates of a packet's rays: which leaves they are of, and their triangles as vectors.

#if defined(MORPHRAY_CPU_PACKET_HIT_LEAVES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_PACKET_HIT_LEAVES_INL_H
#undef MORPHRAY_CPU_PACKET_HIT_LEAVES_INL_H
#else
#define MORPHRAY_CPU_PACKET_HIT_LEAVES_INL_H
#endif

#include <hwy/highway.h>

#include <cstdint>

#include "cpu/packet/packet.h"
#include "cpu/simd/rule_vectors-inl.h"

HWY_BEFORE_NAMESPACE();
namespace morphray::cpu {
namespace HWY_NAMESPACE {

/// Candidates as vectors: corners relative to the origin, rotated for the packet's axis; and ids.
struct CandidateLanes {
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

/// Of as many consecutive rays as there are lanes: those that have a candidate, as bits; the leaf
/// of the first one's; and those whose candidates are of other leaves.
struct Candidates {
    std::uint32_t rays = 0;
    std::uint32_t leaf = 0;
    std::uint32_t others = 0;
};

HWY_INLINE Mask candidates_of(VW candidates, std::uint32_t leaf) {
    return hn::RebindMask(Floats(), hn::Eq(hn::ShiftRight<4>(candidates), hn::Set(Words(), leaf)));
}

HWY_INLINE Candidates find_candidates(const std::uint32_t* indices) {
    const Floats f;
    const hn::RebindToSigned<Floats> ints;
    const VW candidates = hn::Load(Words(), indices);
    Candidates found;
    // Only kNoCandidate has its sign bit set.
    const auto none = hn::Lt(hn::BitCast(ints, candidates), hn::Zero(ints));
    found.rays = mask_bits(hn::Not(hn::RebindMask(f, none)));
    if (found.rays == 0) return found;
    found.leaf = indices[__builtin_ctz(found.rays)] / kLeafTriangles;
    found.others = found.rays & ~mask_bits(candidates_of(candidates, found.leaf));
    return found;
}

/// The candidates of rays that have some. Neighbours have candidates of the same leaves, so these
/// are taken in turn: faster than gathers. Rays without a candidate get some triangle as well.
HWY_INLINE CandidateLanes spread_candidates(const Packet& packet, const std::uint32_t* indices,
                                            const Candidates& found) {
    const Words words;
    const VW candidates = hn::Load(words, indices);
    const SlotLookup slots(hn::And(candidates, hn::Set(words, 15u)));
    CandidateLanes out;
    const HitLeaf* won = &packet.hit_leaves[found.leaf];
    for (int k = 0; k < 3; ++k) {
        for (int axis = 0; axis < 3; ++axis) out.corners[k][axis] = slots(won->corner[k][axis]);
    }
    out.prim_ids = hn::BitCast(words, slots(won->prim_id));
    for (std::uint32_t others = found.others; others != 0;) {
        const std::uint32_t leaf = indices[__builtin_ctz(others)] / kLeafTriangles;
        won = &packet.hit_leaves[leaf];
        const Mask own = candidates_of(candidates, leaf);
        for (int k = 0; k < 3; ++k) {
            for (int axis = 0; axis < 3; ++axis) {
                out.corners[k][axis] =
                    hn::IfThenElse(own, slots(won->corner[k][axis]), out.corners[k][axis]);
            }
        }
        out.prim_ids = hn::IfThenElse(hn::RebindMask(words, own),
                                      hn::BitCast(words, slots(won->prim_id)), out.prim_ids);
        others &= ~mask_bits(own);
    }
    return out;
}

}  // namespace HWY_NAMESPACE
}  // namespace morphray::cpu
HWY_AFTER_NAMESPACE();

#endif
