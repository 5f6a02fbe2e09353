// The vector types of the packet tracer, the values of a leaf at its triangles' corners, and the
// hit rule's plain path on vectors, operation by operation.

#if defined(MORPHRAY_RULE_VECTORS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_RULE_VECTORS_INL_H
#undef MORPHRAY_RULE_VECTORS_INL_H
#else
#define MORPHRAY_RULE_VECTORS_INL_H
#endif

#include <hwy/highway.h>

#include <cstdint>
#include <cstring>

#include "common/interop/triangle.h"

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
#if HWY_TARGET <= HWY_AVX2
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
/// all rotated: project_fast, fast_edges, surely_inside and weighted_hit of the rule in its
/// operations, for triangles that are in front of the origin and that the rays go through. Which
/// rays they suffice for.
HWY_INLINE Mask hit_fast(const VF dir[3], VF slack, const VF corner[3][3], VF& t, VF& u, VF& v) {
    VF x[3], y[3], z[3];
    for (int k = 0; k < 3; ++k) {
        z[k] = corner[k][2];
        x[k] = hn::Sub(hn::Mul(corner[k][0], dir[2]), hn::Mul(dir[0], z[k]));
        y[k] = hn::Sub(hn::Mul(corner[k][1], dir[2]), hn::Mul(dir[1], z[k]));
    }
    const VF ma = hn::Add(hn::Abs(x[0]), hn::Abs(y[0]));
    const VF mb = hn::Add(hn::Abs(x[1]), hn::Abs(y[1]));
    const VF mc = hn::Add(hn::Abs(x[2]), hn::Abs(y[2]));
    const VF m = hn::Add(hn::Add(ma, mb), mc);
    const VF nearest = hn::Min(z[0], hn::Min(z[1], z[2]));
    const VF farthest = hn::Max(z[0], hn::Max(z[1], z[2]));
    const VF depth_range = hn::Sub(farthest, nearest);
    const VF z_size = hn::Max(hn::Abs(nearest), hn::Abs(farthest));
    const VF r = hn::Add(hn::Mul(splat(kFastProjectionError), hn::Add(hn::Add(m, m), z_size)),
                         splat(kFastProjectionFloor));
    const VF bound = hn::Mul(r, hn::Add(m, hn::Add(r, r)));
    const VF eu = hn::Sub(hn::Mul(x[1], y[2]), hn::Mul(y[1], x[2]));
    const VF ev = hn::Sub(hn::Mul(x[2], y[0]), hn::Mul(y[2], x[0]));
    const VF ew = hn::Sub(hn::Mul(x[0], y[1]), hn::Mul(y[0], x[1]));
    const VF size_u = hn::Abs(eu);
    const VF size_v = hn::Abs(ev);
    const VF size_w = hn::Abs(ew);
    const VF sum = hn::Add(hn::Add(size_u, size_v), size_w);
    const VF error = hn::Mul(bound, hn::Max(depth_range, splat(1.0f)));
    const Mask flat = hn::Le(error, hn::Mul(slack, sum));
    // The accurate functions have one sign, and so have these where they exceed their bound.
    const Mask certain = hn::Gt(hn::Min(size_u, hn::Min(size_v, size_w)), bound);
    // scaled_weight() drops nothing here: functions that suffice exceed the bound, and so 2^-20
    // m^2, and their sum is at most 2 m^2.
    const VF scale = rcp_of_positive(hn::Mul(sum, dir[2]));
    const VF wa = hn::Mul(size_u, scale);
    const VF wb = hn::Mul(size_v, scale);
    const VF wc = hn::Mul(size_w, scale);
    t = hn::Add(hn::Add(hn::Mul(wa, z[0]), hn::Mul(wb, z[1])), hn::Mul(wc, z[2]));
    u = hn::Mul(wb, dir[2]);
    v = hn::Mul(wc, dir[2]);
    return hn::And(flat, certain);
}

}  // namespace HWY_NAMESPACE
}  // namespace morphray::cpu
HWY_AFTER_NAMESPACE();

#endif
