#include "cpu/single_ray/single_ray_tracer.h"

#include <cassert>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "cpu/single_ray/single_ray_tracer.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "cpu/single_ray/single_ray_tracer-inl.h"

#if HWY_ONCE

#include "common/simd/simd_dispatch-inl.h"

namespace mray::cpu {
namespace {

HWY_EXPORT(intersect_rays);
HWY_EXPORT(occluded_rays);

}  // namespace

SingleRayTracer::SingleRayTracer(const Bvh& bvh, SimdTarget target)
    : bvh_(&bvh),
      intersect_(SIMD_FUNCTION(intersect_rays, target)),
      occluded_(SIMD_FUNCTION(occluded_rays, target)) {}

void SingleRayTracer::intersect(std::span<const Ray> rays, std::span<Hit> hits) const {
    assert(rays.size() == hits.size());
    intersect_(*bvh_, rays, hits);
}

void SingleRayTracer::occluded(std::span<const Ray> rays, std::span<std::uint8_t> occluded) const {
    assert(rays.size() == occluded.size());
    occluded_(*bvh_, rays, occluded);
}

}  // namespace mray::cpu

#endif  // HWY_ONCE
