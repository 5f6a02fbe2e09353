#include "cpu/scene_space/scene_rays.h"

#include <cassert>
#include <cmath>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "cpu/scene_space/scene_rays.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "cpu/simd/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {

#if HWY_TARGET != HWY_SCALAR

/// The largest exponent of a power of two that is multiplied here: it and its inverse are normal
/// floats.
constexpr int kMostExponent = 126;

/// Makes kLanes / 2 rays. A vector holds the two halves of some rays side by side: lane 2 i has
/// (org, tnear) of ray i, lane 2 i + 1 its (dir, tfar). Returns the lanes 2 i + 1 of rays that are
/// set.
///
/// All operations are those of to_scene() on doubles, rounded to floats. They give its bits:
///
/// 1. Products with powers of two are exact unless they overflow or become denormals. The former
/// are
///    refused, or cut at kInfiniteT; the latter are 0 in to_scene(), too, or end below 2^-100.
/// 2. world - centre is rounded to double there, and then to float; here to float at once. If the
///    exponents differ by less than 29, the difference has at most 53 digits and is exact as a
///    double. Otherwise the smaller number is below a quarter of the distance of the larger one
///    from the next floats, and both ways give the larger one.
HWY_INLINE std::uint32_t make_rays(const StoredRay* from, const float* centre, int exponent,
                                   Ray* rays, std::int32_t* t_exponents) {
    const Mask is_dir = mask_of(0xAAAAAAAAu & kLaneBits);
    FloatVec v[3], end;
    hn::LoadInterleaved4(kFloats, from->org, v[0], v[1], v[2], end);
    const FloatVec largest = max3(abs(v[0]), abs(v[1]), abs(v[2]));
    const FloatVec sum = abs(v[0]) + abs(v[1]) + abs(v[2]);
    // A NaN compares as false.
    const Mask good_dir = (largest >= splat(0x1p-126f)) & (sum <= splat(0x1p126f));
    const IntVec bits = as_int(hn::ShiftRight<23>(as_uint(largest)));
    const IntVec own_exponent = hn::DupOdd(bits) + splat(exponent - 127);
    // Negative ones wrap to large numbers.
    const UintVec above_least = as_uint(own_exponent + splat(kMostExponent));
    const Mask good_exponent = float_mask(!(above_least > splat(2u * kMostExponent)));

    lanes::Float3 dir = lanes::canonical_direction(lanes::Float3(v));
    const FloatVec scale = as_float(as_uint(splat((exponent + 127) << 23)));
    FloatVec org[3];
    Mask good_org = mask_of(kLaneBits);
    for (int axis = 0; axis < 3; ++axis) {
        const FloatVec scaled = (v[axis] - splat(centre[axis])) * scale;
        // A ray whose origin rounds to kOriginExtent is hard: to_scene() decides.
        good_org = good_org & (abs(scaled) < splat(kOriginExtent));
        org[axis] = lanes::snap_coordinate(scaled);
    }

    const FloatVec t_scale = as_float(hn::ShiftLeft<23>(as_uint(own_exponent + splat(127))));
    const FloatVec tnear = hn::DupEven(end);
    const FloatVec tfar = hn::DupOdd(end);
    const Mask good_interval = (tnear <= tfar) & (tfar >= zero());
    FloatVec t = min(max(end, zero()) * t_scale, splat(kInfiniteT));
    const Mask long_enough = t >= splat(0x1p-100f);
    t = zero_unless(long_enough, t);

    hn::StoreInterleaved4(select(is_dir, dir.x, org[0]), select(is_dir, dir.y, org[1]),
                          select(is_dir, dir.z, org[2]), t, kFloats, &rays->org.x);
    hn::StoreU(hn::Neg(own_exponent), kInts, t_exponents);
    const std::uint32_t good_halves =
        bits_of((is_dir & good_dir & long_enough) | and_not(is_dir, good_org)) &
        bits_of(good_interval & good_exponent);
    return good_halves & good_halves << 1 & 0xAAAAAAAAu;
}

#endif

void make_scene_rays(const StoredRay* rays, std::size_t count, const float* centre, int exponent,
                     SceneRays& out) {
    out.hard_count = 0;
    std::size_t i = 0;
#if HWY_TARGET != HWY_SCALAR
    constexpr std::size_t kRays = kLanes / 2;
    const bool usable = std::abs(exponent) <= kMostExponent;
    for (; usable && i + kRays <= count; i += kRays) {
        const std::uint32_t good =
            make_rays(rays + i, centre, exponent, out.rays + i, out.t_exponents + 2 * i);
        constexpr std::uint32_t kAll = 0xAAAAAAAAu & kLaneBits;
        for (std::uint32_t bad = kAll & ~good; bad != 0; bad &= bad - 1) {
            out.hard[out.hard_count++] =
                static_cast<std::uint16_t>(i + static_cast<std::size_t>(__builtin_ctz(bad)) / 2);
        }
    }
#else
    (void)rays, (void)centre, (void)exponent;
#endif
    for (; i < count; ++i) out.hard[out.hard_count++] = static_cast<std::uint16_t>(i);
}

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

#include "common/simd/simd_dispatch-inl.h"

namespace mray::cpu {
namespace {

HWY_EXPORT(make_scene_rays);

}  // namespace

SceneRayMaker::SceneRayMaker(const SceneSpace& space, const SimdTarget& target)
    : centre_{static_cast<float>(space.centre(0)), static_cast<float>(space.centre(1)),
              static_cast<float>(space.centre(2))},
      exponent_(space.exponent()),
      make_(SIMD_FUNCTION(make_scene_rays, target)) {}

void SceneRayMaker::make(std::span<const StoredRay> rays, SceneRays& out) const {
    assert(rays.size() <= SceneRays::kMost);
    make_(rays.data(), rays.size(), centre_, exponent_, out);
}

}  // namespace mray::cpu

#endif  // HWY_ONCE
