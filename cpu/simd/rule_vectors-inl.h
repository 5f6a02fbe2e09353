// The vector types of the packet tracer, the values of a leaf at its triangles' corners, and the
// hit rule's plain path on vectors, operation by operation.

#if defined(MORPHRAY_CPU_SIMD_RULE_VECTORS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_SIMD_RULE_VECTORS_INL_H
#undef MORPHRAY_CPU_SIMD_RULE_VECTORS_INL_H
#else
#define MORPHRAY_CPU_SIMD_RULE_VECTORS_INL_H
#endif

#include <hwy/highway.h>

#include <cstdint>
#include <cstring>

#include "common/interop/hit_rule.h"

HWY_BEFORE_NAMESPACE();
namespace morphray::cpu {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::CappedTag<float, 16>;
using Words = hn::RebindToUnsigned<Floats>;
using VF = hn::Vec<Floats>;
using VW = hn::Vec<Words>;
using Mask = hn::Mask<Floats>;

HWY_INLINE VF splat(float x) { return hn::Set(Floats(), x); }

HWY_INLINE std::uint32_t mask_bits(Mask m) {
    const Floats f;
    std::uint8_t bytes[8] = {};
    hn::StoreMaskBits(f, m, bytes);
    std::uint32_t bits;
    std::memcpy(&bits, bytes, sizeof bits);
    return bits & static_cast<std::uint32_t>((std::uint64_t{1} << hn::Lanes(f)) - 1);
}

/// The mask whose bits these are.
HWY_INLINE Mask mask_of(std::uint32_t bits) {
    const std::uint8_t bytes[8] = {static_cast<std::uint8_t>(bits),
                                   static_cast<std::uint8_t>(bits >> 8)};
    return hn::LoadMaskBits(Floats(), bytes);
}

/// Writes a number where a mask has a lane. Not by a masked store of SSE, which goes around the
/// caches.
HWY_INLINE void store_where(Mask m, std::uint32_t number, std::uint32_t* to) {
    const Words words;
    const VW all = hn::Set(words, number);
    const auto where = hn::RebindMask(words, m);
#if HWY_TARGET == HWY_AVX2
    hn::BlendedStore(all, where, words, to);
#else
    hn::Store(hn::IfThenElse(where, all, hn::Load(words, to)), words, to);
#endif
}

#if HWY_TARGET != HWY_SCALAR
/// Four vectors combined to one: in each 16 bytes what is left of the first, second, third and
/// fourth one's. combine: Min or Max of two vectors.
template <class Combine>
HWY_INLINE VF combine_four(const VF v[4], Combine combine) {
    const Floats f;
    const hn::Repartition<double, Floats> pairs;
    const auto two = [&](VF a, VF b) HWY_ATTR {
        return hn::BitCast(pairs,
                           combine(hn::InterleaveLower(f, a, b), hn::InterleaveUpper(f, a, b)));
    };
    const auto first = two(v[0], v[1]);
    const auto last = two(v[2], v[3]);
    return combine(hn::BitCast(f, hn::InterleaveLower(pairs, first, last)),
                   hn::BitCast(f, hn::InterleaveUpper(pairs, first, last)));
}
#endif

/// Values of a leaf's sixteen vertices at the corners of some of its triangles, given their packed
/// corners.
HWY_INLINE void gather_corners(const float* values, VW packed, VF out[3]) {
    const Floats f;
    const VW byte = hn::Set(Words(), 0xFFu);
    const VW slot[3] = {hn::And(packed, byte), hn::And(hn::ShiftRight<8>(packed), byte),
                        hn::And(hn::ShiftRight<16>(packed), byte)};
    for (int k = 0; k < 3; ++k) {
        if constexpr (hn::MaxLanes(Floats()) == 16) {
            out[k] = hn::TableLookupLanes(hn::Load(f, values), hn::IndicesFromVec(f, slot[k]));
        } else if constexpr (hn::MaxLanes(Floats()) == 8) {
            const auto index = hn::IndicesFromVec(f, hn::And(slot[k], hn::Set(Words(), 7u)));
            const VF low = hn::TableLookupLanes(hn::Load(f, values), index);
            const VF high = hn::TableLookupLanes(hn::Load(f, values + 8), index);
            const auto is_high = hn::Gt(slot[k], hn::Set(Words(), 7u));
            out[k] = hn::IfThenElse(hn::RebindMask(f, is_high), high, low);
        } else {
            const hn::RebindToSigned<Floats> ints;
            out[k] = hn::GatherIndex(f, values, hn::BitCast(ints, slot[k]));
        }
    }
}

/// rcp() on vectors that are positive, in its operations.
HWY_INLINE VF rcp_of_positive(VF x) {
    const Words w;
    VF y = hn::BitCast(Floats(), hn::Sub(hn::Set(w, 0x7EF311C7u), hn::BitCast(w, x)));
    y = hn::Mul(y, hn::Sub(splat(2.0f), hn::Mul(x, y)));
    y = hn::Mul(y, hn::Sub(splat(2.0f), hn::Mul(x, y)));
    return hn::Add(y, hn::Mul(y, hn::Sub(splat(1.0f), hn::Mul(x, y))));
}

/// Likewise of any.
HWY_INLINE VF rcp_exactly(VF x) { return hn::CopySignToAbs(rcp_of_positive(hn::Abs(x)), x); }

/// Rays of one axis and positive dir.z with a triangle each, its corners relative to the origin,
/// all rotated: project_fast, the functions of fast_edges and weighted_hit of the rule in its
/// operations, for triangles that are in front of the origin and that the rays go through.
struct FastHits {
    VF z[3], dz;
    VF size[3];  // of the edge functions

    /// All but the hits. For which rays the rule certainly takes its fast path.
    HWY_INLINE Mask project(const VF dir[3], VF slack, const VF corner[3][3]) {
        VF x[3], y[3];
        dz = dir[2];
        for (int k = 0; k < 3; ++k) {
            z[k] = corner[k][2];
            x[k] = hn::Sub(hn::Mul(corner[k][0], dz), hn::Mul(dir[0], z[k]));
            y[k] = hn::Sub(hn::Mul(corner[k][1], dz), hn::Mul(dir[1], z[k]));
        }
        const auto edge = [&](int i, int j) {
            return hn::Abs(hn::Sub(hn::Mul(x[i], y[j]), hn::Mul(y[i], x[j])));
        };
        size[0] = edge(1, 2);
        size[1] = edge(2, 0);
        size[2] = edge(0, 1);
        const auto reach = [&](int k) { return hn::Add(hn::Abs(x[k]), hn::Abs(y[k])); };
        const VF m = hn::Add(hn::Add(reach(0), reach(1)), reach(2));
        const VF nearest = hn::Min(z[0], hn::Min(z[1], z[2]));
        const VF farthest = hn::Max(z[0], hn::Max(z[1], z[2]));
        const VF depth_range = hn::Sub(farthest, nearest);
        // The bound of fast_edges, fused or not: 2^-18 more than makes up for the difference.
        // Checked: proofs/fast_hits.g.
        const VF r = hn::MulAdd(splat(kFastProjectionError * (1 + 0x1p-18f)),
                                hn::MulAdd(splat(2.0f), m, farthest),
                                splat(kFastProjectionFloor * (1 + 0x1p-18f)));
        const VF bound = hn::Mul(r, hn::MulAdd(splat(2.0f), r, m));
        const VF error = hn::Mul(bound, hn::Max(depth_range, splat(1.0f)));
        const Mask flat = hn::Le(error, hn::Mul(slack, sum()));
        // The accurate functions have one sign, and so have these where they exceed their bound.
        const Mask certain = hn::Gt(hn::Min(size[0], hn::Min(size[1], size[2])), bound);
        // All z are positive, and their range less than the farthest, so that t is certain
        // (weighted_hit). Triangles that reach behind the origin are left to the whole rule.
        const Mask ahead = hn::Gt(nearest, hn::Mul(splat(0x1p-20f), farthest));
        return hn::And(hn::And(flat, certain), ahead);
    }

    /// scaled_weight() drops nothing here: functions that suffice exceed the bound, and so 2^-20
    /// m^2, and their sum is at most 2 m^2.
    HWY_INLINE void weigh(VF& t, VF& u, VF& v) const {
        const VF scale = rcp_of_positive(sum());
        u = hn::Mul(size[1], scale);
        v = hn::Mul(size[2], scale);
        const VF rest = hn::Sub(splat(1.0f), hn::Add(u, v));
        const VF wa = hn::Max(rest, hn::Zero(Floats()));
        const VF mean = hn::Add(hn::Add(hn::Mul(wa, z[0]), hn::Mul(u, z[1])), hn::Mul(v, z[2]));
        t = hn::Mul(mean, rcp_of_positive(dz));
    }

private:
    HWY_INLINE VF sum() const { return hn::Add(hn::Add(size[0], size[1]), size[2]); }
};

}  // namespace HWY_NAMESPACE
}  // namespace morphray::cpu
HWY_AFTER_NAMESPACE();

#endif
