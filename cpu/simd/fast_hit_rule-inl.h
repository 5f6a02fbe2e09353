// The fast path of the hit rule on vectors, operation by operation, and the values of a leaf at its
// triangles' corners.

#if defined(MORPHRAY_CPU_SIMD_FAST_HIT_RULE_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_SIMD_FAST_HIT_RULE_INL_H
#undef MORPHRAY_CPU_SIMD_FAST_HIT_RULE_INL_H
#else
#define MORPHRAY_CPU_SIMD_FAST_HIT_RULE_INL_H
#endif

#include <hwy/highway.h>

#include <cstdint>

#include "common/interop/hit_rule.h"
#include "common/simd/vectors-inl.h"

HWY_BEFORE_NAMESPACE();
namespace morphray::cpu {
namespace HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

/// Values of a leaf's sixteen vertices at the corners of some of its triangles, given their packed
/// corners.
HWY_INLINE void gather_corners(const float* values, UintVec packed, FloatVec out[3]) {
    const UintVec byte = splat(0xFFu);
    out[0] = LaneLookup(packed & byte)(values);
    out[1] = LaneLookup(shift_right<8>(packed) & byte)(values);
    out[2] = LaneLookup(shift_right<16>(packed) & byte)(values);
}

/// rcp() on vectors that are positive, in its operations.
HWY_INLINE FloatVec rcp_of_positive(FloatVec x) {
    FloatVec y = as_float(splat(0x7EF311C7u) - as_uint(x));
    y = y * (splat(2.0f) - x * y);
    y = y * (splat(2.0f) - x * y);
    return y + y * (splat(1.0f) - x * y);
}

/// Likewise of any.
HWY_INLINE FloatVec rcp_exactly(FloatVec x) {
    return hn::CopySignToAbs(rcp_of_positive(abs(x)), x);
}

/// Rays of one axis and positive dir.z with a triangle each, its corners relative to the origin,
/// all rotated: project_fast, the functions of fast_edges and weighted_hit of the rule in its
/// operations, for triangles that are in front of the origin and that the rays go through.
struct FastHits {
    FloatVec z[3], dz;
    FloatVec size[3];  // of the edge functions

    /// All but the hits. For which rays the rule certainly takes its fast path.
    HWY_INLINE Mask project(const FloatVec dir[3], FloatVec slack, const FloatVec corner[3][3]) {
        FloatVec x[3], y[3];
        dz = dir[2];
        for (int k = 0; k < 3; ++k) {
            z[k] = corner[k][2];
            x[k] = corner[k][0] * dz - dir[0] * z[k];
            y[k] = corner[k][1] * dz - dir[1] * z[k];
        }
        const auto edge = [&](int i, int j) { return abs(x[i] * y[j] - y[i] * x[j]); };
        size[0] = edge(1, 2);
        size[1] = edge(2, 0);
        size[2] = edge(0, 1);
        const auto reach = [&](int k) { return abs(x[k]) + abs(y[k]); };
        const FloatVec m = reach(0) + reach(1) + reach(2);
        const FloatVec nearest = min(z[0], min(z[1], z[2]));
        const FloatVec farthest = max(z[0], max(z[1], z[2]));
        const FloatVec depth_range = farthest - nearest;
        // The bound of fast_edges, fused or not: 2^-18 more than makes up for the difference.
        // Checked: proofs/fast_hits.g.
        const FloatVec r =
            mul_add(splat(kFastProjectionError * (1 + 0x1p-18f)), mul_add(splat(2.0f), m, farthest),
                    splat(kFastProjectionFloor * (1 + 0x1p-18f)));
        const FloatVec bound = r * mul_add(splat(2.0f), r, m);
        const FloatVec error = bound * max(depth_range, splat(1.0f));
        const Mask flat = error <= slack * sum();
        // The accurate functions have one sign, and so have these where they exceed their bound.
        const Mask certain = min(size[0], min(size[1], size[2])) > bound;
        // All z are positive, and their range less than the farthest, so that t is certain
        // (weighted_hit). Triangles that reach behind the origin are left to the whole rule.
        const Mask ahead = nearest > splat(0x1p-20f) * farthest;
        return flat & certain & ahead;
    }

    /// scaled_weight() drops nothing here: functions that suffice exceed the bound, and so 2^-20
    /// m^2, and their sum is at most 2 m^2.
    HWY_INLINE void weigh(FloatVec& t, FloatVec& u, FloatVec& v) const {
        const FloatVec scale = rcp_of_positive(sum());
        u = size[1] * scale;
        v = size[2] * scale;
        const FloatVec rest = splat(1.0f) - (u + v);
        const FloatVec wa = max(rest, zero());
        const FloatVec mean = wa * z[0] + u * z[1] + v * z[2];
        t = mean * rcp_of_positive(dz);
    }

private:
    HWY_INLINE FloatVec sum() const { return size[0] + size[1] + size[2]; }
};

}  // namespace HWY_NAMESPACE
}  // namespace morphray::cpu
HWY_AFTER_NAMESPACE();

#endif
