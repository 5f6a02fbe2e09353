// Rays of an array as vectors.

#if defined(MORPHRAY_PACKET_RAYS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_PACKET_RAYS_INL_H
#undef MORPHRAY_PACKET_RAYS_INL_H
#else
#define MORPHRAY_PACKET_RAYS_INL_H
#endif

#include <hwy/highway.h>

#include <cstddef>

#include "common/interop/ray.h"
#include "cpu/rule_vectors-inl.h"

HWY_BEFORE_NAMESPACE();
namespace morphray::cpu {
namespace HWY_NAMESPACE {

static_assert(sizeof(Ray) == 8 * sizeof(float) && offsetof(Ray, dir) == 4 * sizeof(float));

#if HWY_TARGET != HWY_SCALAR
/// Directions and tfar of rays[0], rays[4], rays[8] ..., four floats each.
template <std::size_t kFloats>
HWY_INLINE auto load_every_fourth(const Ray* rays) {
    const hn::FixedTag<float, kFloats> floats;
    if constexpr (kFloats == 4) {
        return hn::LoadU(floats, &rays->dir.x);
    } else {
        return hn::Combine(floats, load_every_fourth<kFloats / 2>(rays + kFloats / 2),
                           load_every_fourth<kFloats / 2>(rays));
    }
}

#endif

/// Directions and tfar of consecutive rays.
HWY_INLINE void load_rays(const Ray* rays, VF d[3], VF& tfar) {
#if HWY_TARGET == HWY_SCALAR
    d[0] = splat(rays->dir.x);
    d[1] = splat(rays->dir.y);
    d[2] = splat(rays->dir.z);
    tfar = splat(rays->tfar);
#else
    const Floats f;
    const hn::Repartition<double, Floats> pairs;
    const auto row = [&](std::size_t i)
                         HWY_ATTR { return load_every_fourth<hn::MaxLanes(Floats())>(rays + i); };
    const VF r0 = row(0), r1 = row(1), r2 = row(2), r3 = row(3);
    const auto xy01 = hn::BitCast(pairs, hn::InterleaveLower(f, r0, r1));
    const auto xy23 = hn::BitCast(pairs, hn::InterleaveLower(f, r2, r3));
    const auto zw01 = hn::BitCast(pairs, hn::InterleaveUpper(f, r0, r1));
    const auto zw23 = hn::BitCast(pairs, hn::InterleaveUpper(f, r2, r3));
    d[0] = hn::BitCast(f, hn::InterleaveLower(pairs, xy01, xy23));
    d[1] = hn::BitCast(f, hn::InterleaveUpper(pairs, xy01, xy23));
    d[2] = hn::BitCast(f, hn::InterleaveLower(pairs, zw01, zw23));
    tfar = hn::BitCast(f, hn::InterleaveUpper(pairs, zw01, zw23));
#endif
}

}  // namespace HWY_NAMESPACE
}  // namespace morphray::cpu
HWY_AFTER_NAMESPACE();

#endif
