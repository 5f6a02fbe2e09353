// The traversals, compiled once for each target.
//
// All boxes that hold a hit are met, and the hit rule decides which triangles are hit, so the
// answers have the bits of ScalarTracer. The order of a ray's triangles does not matter: the
// closest hit is the least in a total order (is_closer), and boxes are culled only beyond the
// closest t.
#include "cpu/single_ray/single_ray_tracer.h"

#include <cassert>
#include <cmath>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "cpu/single_ray/single_ray_tracer.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "cpu/single_ray/ray_stream-inl.h"
#include "cpu/single_ray/walks-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu::HWY_NAMESPACE {

// Batches of at most this many rays are traced ray by ray, unless they are alike: a stream of them
// costs more time than it saves (lab/notes/cpu_tracer.md).
inline constexpr std::size_t kAloneIntersected = kTogetherAtNode;
inline constexpr std::size_t kAloneOccluded = kLanes < 16 ? 4 : 6;

// Rays of a packet, at most this many, may be alike: they go on together below a node if they are
// more than this many.
inline constexpr std::size_t kPacketRays = 16;
inline constexpr std::size_t kTogetherAlike = kLanes < 16 ? 2 : 4;

/// Whether the rays begin near each other and go in much the same direction, as those of a packet.
HWY_INLINE bool are_alike(std::span<const Ray> rays) {
    const Ray& first = rays.front();
    float org = 0, dir = 0;
    for (const Ray& ray : rays.subspan(1)) {
        for (int axis = 0; axis < 3; ++axis) {
            org = std::max(org, std::abs(ray.org[axis] - first.org[axis]));
            dir = std::max(dir, std::abs(ray.dir[axis] - first.dir[axis]));
        }
    }
    return org <= 0x1p-6f * kSceneExtent && dir <= 0x1p-4f;
}

void intersect_rays(const Bvh& bvh, std::span<const Ray> rays, std::span<Hit> hits) {
    assert(rays.size() == hits.size());
    std::size_t together = kTogetherAtNode;
    if (rays.size() <= kPacketRays && rays.size() > kTogetherAlike && are_alike(rays)) {
        together = kTogetherAlike;
    } else if (rays.size() <= kAloneIntersected) {
        for (std::size_t i = 0; i < rays.size(); ++i) hits[i] = intersect_one(bvh, rays[i]);
        return;
    }
    for_each_stream(
        rays, [&](const Ray* batch, std::span<const std::uint16_t> order, std::size_t first)
                  HWY_ATTR { ClosestStream(bvh, batch, order, together).intersect(&hits[first]); });
}

void occluded_rays(const Bvh& bvh, std::span<const Ray> rays, std::span<std::uint8_t> occluded) {
    assert(rays.size() == occluded.size());
    if (rays.size() <= kAloneOccluded) {
        for (std::size_t i = 0; i < rays.size(); ++i) occluded[i] = occluded_one(bvh, rays[i]);
        return;
    }
    for_each_stream(rays, [&](const Ray* batch, std::span<const std::uint16_t> order,
                              std::size_t first) HWY_ATTR {
        const std::uint64_t hits = OccludedStream(bvh, batch, order).trace();
        for (std::size_t i = 0; i < order.size(); ++i) {
            occluded[first + order[i]] = static_cast<std::uint8_t>(hits >> i & 1);
        }
    });
}

}  // namespace mray::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

#include "common/simd/simd_dispatch-inl.h"

namespace mray::cpu {

HWY_EXPORT(intersect_rays);
HWY_EXPORT(occluded_rays);

SingleRayTracer::SingleRayTracer(const Bvh& bvh, SimdTarget target)
    : bvh_(&bvh),
      intersect_(SIMD_FUNCTION(intersect_rays, target)),
      occluded_(SIMD_FUNCTION(occluded_rays, target)) {}

}  // namespace mray::cpu

#endif  // HWY_ONCE
