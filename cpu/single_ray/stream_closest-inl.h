// Closest hits of a stream of up to 64 rays of one octant.
//
// The rays of a stream go down the tree together, front to back (cpu/single_ray/walks-inl.h). A
// leaf's triangles are tested with rays for lanes (cpu/single_ray/closest_leaf-inl.h). Where few
// rays are left they go on alone, up to 64 of them in turn (cpu/single_ray/single_rays-inl.h).
#if defined(MORPHRAY_CPU_SINGLE_RAY_STREAM_CLOSEST_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_SINGLE_RAY_STREAM_CLOSEST_INL_H
#undef MORPHRAY_CPU_SINGLE_RAY_STREAM_CLOSEST_INL_H
#else
#define MORPHRAY_CPU_SINGLE_RAY_STREAM_CLOSEST_INL_H
#endif

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>

#include "common/bvh/bvh.h"
#include "cpu/single_ray/closest_leaf-inl.h"
#include "cpu/single_ray/ray_stream-inl.h"
#include "cpu/single_ray/single_rays-inl.h"
#include "cpu/single_ray/walks-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

// Rays go on together below a node if they are more than this many (lab/notes/cpu_tracer.md has
// the figures).
inline constexpr std::size_t kTogetherAtNode = kLanes < 8 ? 4 : kLanes == 8 ? 8 : 16;
// Fewer rays than these are traced one after the other.
inline constexpr std::size_t kFewRays = 4;

class ClosestStream {
public:
    /// rays[order[i]], of one octant: at least one and at most kStreamRays. They go on together
    /// below a node if they are more than `together`, at most kTogetherAtNode.
    HWY_INLINE ClosestStream(const Bvh& bvh, const Ray* rays, std::span<const std::uint16_t> order,
                             std::size_t together = kTogetherAtNode)
        : bvh_(bvh),
          order_(order),
          together_(together),
          stream_(make_stream(rays, order)),
          closest_(stream_, order.size()) {}

    /// Sets hits[order[i]].
    HWY_INLINE void intersect(Hit* hits) {
        const std::size_t count = order_.size();
        if (count > together_) {
            walk_together(bvh_, stream_, count, *this);
            single_rays_.intersect(bvh_, stream_, closest_);
        } else if (count >= kFewRays) {
            for (std::uint32_t i = 0; i < count; ++i) single_rays_.add(i, 0);
            single_rays_.intersect(bvh_, stream_, closest_);
        } else {
            for (std::size_t i = 0; i < count; ++i) intersect_ray(bvh_, stream_, i, closest_);
        }
        for (std::size_t i = 0; i < count; ++i) hits[order_[i]] = closest_.hit(i);
    }

    // For walk_together().
    static constexpr bool kFrontToBack = true;
    HWY_INLINE const float* last_depths() const { return closest_.last; }
    HWY_INLINE std::uint64_t rays_left(std::uint64_t rays, float t) const {
        std::uint64_t left = 0;
        for (std::size_t first = 0; first < kStreamRays; first += kLanes)
            left |= std::uint64_t{bits_of(load(closest_.last + first) >= t)} << first;
        return left & rays;
    }
    HWY_INLINE bool stay_together(std::uint64_t rays) const {
        return static_cast<std::size_t>(std::popcount(rays)) > together_;
    }
    HWY_INLINE void part(std::uint64_t rays, std::uint32_t child) {
        if (!single_rays_.has_room_for(kTogetherAtNode))
            single_rays_.intersect(bvh_, stream_, closest_);
        for (; rays != 0; rays &= rays - 1)
            single_rays_.add(static_cast<std::uint32_t>(std::countr_zero(rays)), child);
    }
    HWY_INLINE void visit_leaf(std::uint64_t rays, const Leaf& leaf) {
        for_rays_of_leaf(
            rays,
            [&](std::size_t first, std::uint32_t asked)
                HWY_ATTR { intersect_leaf_together(stream_, first, asked, leaf, closest_); },
            [&](std::size_t ray) HWY_ATTR { intersect_leaf_alone(stream_, ray, leaf, closest_); });
    }

private:
    const Bvh& bvh_;
    std::span<const std::uint16_t> order_;
    std::size_t together_;
    RayStream stream_;
    ClosestHits closest_;
    SingleRays single_rays_;
};

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif  // per target
