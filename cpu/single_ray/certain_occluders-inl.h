// Tests by plain edge functions and depths that are certain, so that the hit rule need not be
// asked: a triangle occludes a ray, with a hit between tnear and tfar; a hit would lie behind the
// origin; a hit would lie beyond tfar.
//
// Occluders. Names (lab/proofs/certain.g; e = 2^-24): E the magnitudes of the exact edge functions,
// z the vertices' z by the sign of dir.z, Z the largest |z|, zbar the mean of z under E. |e| are
// the magnitudes of plain edge functions with |E - |e|| <= bound, all in units of dir.z^2 for
// slopes; s the sum of the |e|, n the sum of |e| z; X = max(kSceneExtent, |org|), so Z <= 2.001 X.
// 1. All e are beyond the bound and have one sign. So have the exact ones, and none is 0: the ray
//    goes through the triangle, whichever path of the rule decides.
// 2. n / s is within (2 bound range) / s, at most 4 bound Z / s, of zbar, as the deviations from a
//    mean add up to at most 2 range (docs/design/arithmetic.md, "Depth").
// 3. The exact path's z is within 6.32 e (range + Z), at most 19 e Z, of zbar. The fast path's is
//    off by 2 B range / S more, with B and S those of the rule's own functions.
// 4. The test demands from s <= n and kCertainBound bound Z <= n - from s (and the same up to
//    `to`). |n| <= s Z, so bound / s <= 1 / kCertainBound but for rounding.
// 5. The rule's own functions are the |e|, or, where these are of slopes, the same in other
//    operations: with M the largest |x'| + |y'| and r of edge_bound for the leaf, s <= 3 M^2, so
//    step 4 makes M at least 32 r. Coordinates of both kinds differ by 2 (8 e (X + Z) + 5 e X), so
//    the sum of all six by an eighth of 3 M at most, and B by less than a factor of 2: B <= 2
//    bound, S >= s - 3 bound - 3 B >= s - 9 bound >= 0.71 s. So 2 B range / S is at most
//    8 bound Z / (0.71 s).
// 6. A hit needs a z beyond 2 B range / S + 8 e range + 8 e Z, at most 11.3 bound Z / s + 24.1 e Z.
// 7. Together bound / s has 4 + 2 * 11.3 < kCertainBound of Z. The rest is at most 126 e X: 6.3 e Z
//    of the roundings of n, s and the test, 19 e Z of step 3, 24.1 e Z of step 6, 3.4 e Z of t = z
//    rcp(dir.z), and 5 roundings of `to`, which is up to 4 X.
// 8. kCertainDepth X = 256 e X covers this and 2^-17 X on top: t could move by 2^-18 of X and a hit
//    would be in range all the same.
// 9. Nothing overflows: origins farther than kCertainOrigin have no certain occluders, so from and
//    to are at most 2^32. Products that underflow are off by 2^-124 in all; s is at least 3 bound,
//    from at least 2^4, so e from s is at least 2^-116.
//
// A vertex that is not finite is left to the caller.
//
// Beyond tfar (certainly_beyond). The test demands kCertainBound bound <= s and
// beyond s + kBeyondBound bound R <= n, with R the range of z, and beyond tfar |dir.z| with
// kBeyondDepth X added. Most of these triangles are those at which shadow rays end.
// 1. Steps 2, 3 and 5 hold for every triangle that the rule finds hit: they need no e beyond the
//    bound, and bound / s is at most 1 / kCertainBound.
// 2. n / s is within 2 bound R / s of zbar. The fast path is off by 2 B R / S, where step 5 makes B
//    at most 1.27 bound and S at least s - 3 bound - 3 B. kBeyondBound covers both.
// 3. kBeyondDepth X = 128 e X covers what is left but for step 6, which only makes hits fewer: 119
//    e X. So t of a hit would exceed tfar.
// 4. Where tfar |dir.z| is more than 4 X, no n / s is: beyond is capped there, and kHugeReciprocal
//    for origins farther than kCertainOrigin.
//
// Behind the origin (may_be_ahead; lab/proofs/near.g). Names as above.
// 1. |E - |e|| <= bound for each of the three.
// 2. A hit has a z of certain sign (docs/design/arithmetic.md, "In front"), so the sum of E z is
//    positive.
// 3. By step 1, the sum of E z is at most n + 3 bound Z.
// 4. n as computed is off by at most 3 e s Z. It is below 2^127 for vertices within kSceneExtent
//    and any origin.
// 5. So a ray misses if n + Z (kBehindError s + 4 bound) is negative.
// 6. Unlike in the rule, products may underflow: three in n, by 2^-126 each, and kBehindError s and
//    the product with Z in step 5. kBehindError s does not matter to a bound of at least 2^-97;
//    kBehindUnderflow is added for the others.
#if defined(MORPHRAY_CPU_SINGLE_RAY_CERTAIN_OCCLUDERS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_SINGLE_RAY_CERTAIN_OCCLUDERS_INL_H
#undef MORPHRAY_CPU_SINGLE_RAY_CERTAIN_OCCLUDERS_INL_H
#else
#define MORPHRAY_CPU_SINGLE_RAY_CERTAIN_OCCLUDERS_INL_H
#endif

#include <cstddef>

#include "common/interop/packet_bounds.h"
#include "cpu/simd/lanes-inl.h"
#include "cpu/single_ray/ray_stream-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

/// n, by the sign of dir.z, and s of plain edge functions.
struct DepthSum {
    FloatVec n;
    FloatVec s;
};

/// Fused or not: this decides no hit without a bound.
HWY_INLINE DepthSum depth_sum(const lanes::Edges& e, FloatVec za, FloatVec zb, FloatVec zc,
                              FloatVec dz) {
    const FloatVec au = abs(e.u), av = abs(e.v), aw = abs(e.w);
    const FloatVec n = mul_add(aw, zc, mul_add(av, zb, au * za));
    return {n ^ (dz & splat(-0.0f)), sum3(au, av, aw)};
}

/// The range of z in which a hit is certain, by the sign of dir.z, and where hits beyond tfar
/// begin.
struct CertainRange {
    FloatVec from;
    FloatVec to;
    FloatVec beyond;
};

/// Loads the ranges of the rays from `first` on.
HWY_INLINE CertainRange certain_ranges(const RayStream& stream, std::size_t first) {
    return {load(stream.certain_from + first), load(stream.certain_to + first),
            load(stream.certain_beyond + first)};
}

/// Loads the range of one ray into all lanes.
HWY_INLINE CertainRange certain_range(const RayStream& stream, std::size_t ray) {
    return {splat(stream.certain_from[ray]), splat(stream.certain_to[ray]),
            splat(stream.certain_beyond[ray])};
}

/// The lanes in which the rule certainly finds a hit, if the vertices are finite. Of e it takes u,
/// v, w, bound and depth_size, which may be those of a whole leaf.
HWY_INLINE Mask certain_occluders(const lanes::Edges& e, const DepthSum& depth,
                                  const CertainRange& range) {
    const Mask inside = (min3(e.u, e.v, e.w) > e.bound) | (max3(e.u, e.v, e.w) < -e.bound);
    const FloatVec slack = kCertainBound * e.bound * e.depth_size;
    return inside & (neg_mul_add(range.from, depth.s, depth.n) >= slack) &
           (mul_sub(range.to, depth.s, depth.n) >= slack);
}

/// The lanes whose triangle is hit beyond tfar, if at all. Of e it takes bound, as above, and
/// depth_range.
HWY_INLINE Mask certainly_beyond(const lanes::Edges& e, const DepthSum& depth,
                                 const CertainRange& range) {
    const FloatVec slack = kBeyondBound * e.bound * e.depth_range;
    return (neg_mul_add(range.beyond, depth.s, depth.n) >= slack) &
           (depth.s >= kCertainBound * e.bound);
}

// More than what underflow takes from the products: 2^-120.
inline constexpr float kBehindUnderflow = 0x1p-120f;

/// False in lanes whose triangle would be hit behind the origin only. Of e it takes bound and
/// depth_size, as above.
HWY_INLINE Mask may_be_ahead(const lanes::Edges& e, const DepthSum& depth) {
    const FloatVec error = mul_add(splat(kBehindError), depth.s, 4.0f * e.bound);
    const FloatVec slack = mul_add(e.depth_size, error, splat(kBehindUnderflow));
    return depth.n >= -slack;
}

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif  // per target
