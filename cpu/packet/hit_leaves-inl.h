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
#include "cpu/simd/fast_hit_rule-inl.h"

HWY_BEFORE_NAMESPACE();
namespace morphray::cpu {
namespace HWY_NAMESPACE {

/// Candidates as vectors: corners relative to the origin, rotated for the packet's axis; and ids.
struct CandidateLanes {
    FloatVec corners[3][3];
    UintVec prim_ids;
};

/// Of as many consecutive rays as there are lanes: those that have a candidate, as bits; the leaf
/// of the first one's; and those whose candidates are of other leaves.
struct Candidates {
    std::uint32_t rays = 0;
    std::uint32_t leaf = 0;
    std::uint32_t others = 0;
};

HWY_INLINE Mask candidates_of(UintVec candidates, std::uint32_t leaf) {
    return float_mask(shift_right<4>(candidates) == splat(leaf));
}

HWY_INLINE Candidates find_candidates(const std::uint32_t* indices) {
    const UintVec candidates = load(indices);
    Candidates found;
    // Only kNoCandidate has its sign bit set.
    found.rays = bits_of(!float_mask(as_int(candidates) < splat(0)));
    if (found.rays == 0) return found;
    found.leaf = indices[__builtin_ctz(found.rays)] / kLeafTriangles;
    found.others = found.rays & ~bits_of(candidates_of(candidates, found.leaf));
    return found;
}

/// The candidates of rays that have some. Neighbours have candidates of the same leaves, so these
/// are taken in turn: faster than gathers. Rays without a candidate get some triangle as well.
HWY_INLINE CandidateLanes spread_candidates(const Packet& packet, const std::uint32_t* indices,
                                            const Candidates& found) {
    const UintVec candidates = load(indices);
    const LaneLookup slots(candidates & splat(15u));
    CandidateLanes out;
    const HitLeaf* won = &packet.hit_leaves[found.leaf];
    for (int k = 0; k < 3; ++k) {
        for (int axis = 0; axis < 3; ++axis) out.corners[k][axis] = slots(won->corner[k][axis]);
    }
    out.prim_ids = as_uint(slots(won->prim_id));
    for (std::uint32_t others = found.others; others != 0;) {
        const std::uint32_t leaf = indices[__builtin_ctz(others)] / kLeafTriangles;
        won = &packet.hit_leaves[leaf];
        const Mask own = candidates_of(candidates, leaf);
        for (int k = 0; k < 3; ++k) {
            for (int axis = 0; axis < 3; ++axis) {
                out.corners[k][axis] =
                    select(own, slots(won->corner[k][axis]), out.corners[k][axis]);
            }
        }
        out.prim_ids = select(uint_mask(own), as_uint(slots(won->prim_id)), out.prim_ids);
        others &= ~bits_of(own);
    }
    return out;
}

}  // namespace HWY_NAMESPACE
}  // namespace morphray::cpu
HWY_AFTER_NAMESPACE();

#endif
