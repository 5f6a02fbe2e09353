// A point's rays as vectors.

#if defined(MORPHRAY_CPU_PACKET_LIGHT_PACKET_RAYS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_PACKET_LIGHT_PACKET_RAYS_INL_H
#undef MORPHRAY_CPU_PACKET_LIGHT_PACKET_RAYS_INL_H
#else
#define MORPHRAY_CPU_PACKET_LIGHT_PACKET_RAYS_INL_H
#endif

#include <hwy/highway.h>

#include <cstddef>
#include <cstdint>

#include "cpu/packet/packet.h"
#include "cpu/simd/fast_hit_rule-inl.h"

HWY_BEFORE_NAMESPACE();
namespace morphray::cpu {
namespace HWY_NAMESPACE {

/// As many rays of a block as there are lanes, from `first` on.
HWY_INLINE void load_rays(const SharedOriginRays& rays, std::size_t first, FloatVec d[3],
                          FloatVec& tfar) {
    for (int axis = 0; axis < 3; ++axis) d[axis] = load(rays.dir[axis] + first);
    tfar = load(rays.tfar + first);
}

/// Those of a block that were put together anew, from packet.place[first] on.
HWY_INLINE void gather_rays(const Packet& packet, std::uint32_t first, SharedOriginRays& rays) {
    rays = SharedOriginRays::none();
    for (std::uint32_t i = 0; i < kBlockRays; ++i) {
        const std::uint16_t place = packet.place[first + i];
        if (place == kNoPlace) continue;
        rays.set(i, packet.rays[place / kBlockRays].ray({}, place % kBlockRays));
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace morphray::cpu
HWY_AFTER_NAMESPACE();

#endif
