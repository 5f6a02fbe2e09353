// Closest hits of a stream of up to 64 rays of one octant.
//
// The rays of a stream go down the tree together, front to back, with a mask of rays for each entry
// of the stack: a node's boxes are tested first for all rays at once and then for each ray
// (cpu/single_ray/ray_bundle-inl.h), a leaf's triangles with rays for lanes
// (cpu/single_ray/closest_leaf-inl.h), which are packed where they fill few lanes
// (cpu/single_ray/packed_rays-inl.h). Where few rays are left they go on alone, up to 64 of them
// in turn (cpu/single_ray/single_rays-inl.h).
//
// An entry has a bound of the least depth of hits in its box. Rays whose last_depth is before it
// leave the mask when the entry is taken: a hit in the box would not be closer, nor as close.
#if defined(MORPHRAY_CPU_SINGLE_RAY_STREAM_CLOSEST_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_SINGLE_RAY_STREAM_CLOSEST_INL_H
#undef MORPHRAY_CPU_SINGLE_RAY_STREAM_CLOSEST_INL_H
#else
#define MORPHRAY_CPU_SINGLE_RAY_STREAM_CLOSEST_INL_H
#endif

#include <bit>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <span>

#include "common/bvh/bvh.h"
#include "cpu/single_ray/closest_leaf-inl.h"
#include "cpu/single_ray/one_ray-inl.h"
#include "cpu/single_ray/packed_rays-inl.h"
#include "cpu/single_ray/ray_bundle-inl.h"
#include "cpu/single_ray/ray_stream-inl.h"
#include "cpu/single_ray/single_rays-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

// Rays go on together below a node if they are more than this many, and a vector of rays in a leaf
// if it has more than this many of them (lab/notes/cpu_tracer.md has the figures).
inline constexpr std::size_t kTogetherAtNode = kLanes < 8 ? 4 : kLanes == 8 ? 8 : 16;
inline constexpr std::size_t kTogetherInLeaf = kLanes < 8 ? kLanes / 2 + 1 : kLanes == 8 ? 3 : 6;
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
            bundle_ = bundle_of(stream_, count);
            descend();
            single_rays_.intersect(bvh_, stream_, closest_);
        } else if (count >= kFewRays) {
            for (std::uint32_t i = 0; i < count; ++i) single_rays_.add(i, 0);
            single_rays_.intersect(bvh_, stream_, closest_);
        } else {
            for (std::size_t i = 0; i < count; ++i) intersect_ray(bvh_, stream_, i, closest_);
        }
        for (std::size_t i = 0; i < count; ++i) hits[order_[i]] = closest_.hit(i);
    }

private:
    struct Entry {
        std::uint64_t rays;
        std::uint32_t child;
        float t_least;
    };

    /// Those among `rays` whose last_depth is not before t.
    HWY_INLINE std::uint64_t rays_reaching(std::uint64_t rays, float t) const {
        std::uint64_t reaching = 0;
        for (std::size_t first = 0; first < kStreamRays; first += kLanes)
            reaching |= std::uint64_t{bits_of(load(closest_.last + first) >= t)} << first;
        return reaching & rays;
    }

    HWY_INLINE void descend() {
        Entry stack[kMaxStack];
        stack[0] = {~std::uint64_t{0} >> (kStreamRays - order_.size()), 0, 0};
        for (std::size_t size = 1; size > 0;) {
            const Entry entry = stack[--size];
            const std::uint64_t rays = rays_reaching(entry.rays, entry.t_least);
            if (rays == 0) continue;
            if ((entry.child & kLeafBit) != 0) {
                visit_leaf(rays, bvh_.leaves[entry.child & ~kLeafBit]);
            } else if (static_cast<std::size_t>(std::popcount(rays)) <= together_) {
                leave_alone(rays, entry.child);
            } else {
                size = visit_node(rays, bvh_.nodes[entry.child], stack, size);
            }
        }
    }

    HWY_INLINE void visit_leaf(std::uint64_t rays, const Leaf& leaf) {
        if (static_cast<std::size_t>(std::popcount(rays)) > kTogetherInLeaf &&
            PackedRays::is_worth_packing(rays)) {
            return visit_leaf_packed(rays, leaf);
        }
        for (std::size_t first = 0; first < kStreamRays; first += kLanes) {
            auto asked = static_cast<std::uint32_t>(rays >> first & kLaneBits);
            if (static_cast<std::size_t>(std::popcount(asked)) > kTogetherInLeaf) {
                intersect_leaf_together(stream_, first, asked, leaf, closest_);
                continue;
            }
            for (; asked != 0; asked &= asked - 1) {
                const std::size_t ray = first + static_cast<std::size_t>(std::countr_zero(asked));
                intersect_leaf_alone(stream_, ray, leaf, closest_);
            }
        }
    }

    HWY_INLINE void visit_leaf_packed(std::uint64_t rays, const Leaf& leaf) {
        packed_.pack(stream_, closest_, rays);
        std::size_t first = 0;
        for (; first + kTogetherInLeaf < packed_.count(); first += kLanes)
            packed_.intersect(first, leaf, closest_);
        for (; first < packed_.count(); ++first)
            intersect_leaf_alone(stream_, packed_[first], leaf, closest_);
    }

    HWY_INLINE void leave_alone(std::uint64_t rays, std::uint32_t child) {
        if (!single_rays_.has_room_for(kTogetherAtNode))
            single_rays_.intersect(bvh_, stream_, closest_);
        for (; rays != 0; rays &= rays - 1)
            single_rays_.add(static_cast<std::uint32_t>(std::countr_zero(rays)), child);
    }

    /// Pushes the children that rays meet so that the nearest is on top; returns the new size.
    HWY_INLINE std::size_t visit_node(std::uint64_t rays, const Node& node, Entry* stack,
                                      std::size_t size) {
        FloatVec least[kVectors];
        const float farthest = largest_of(closest_.last, kStreamRays);
        std::uint32_t slots = near_slots(bundle_, farthest, node, least);
        if (slots == 0) return size;
        std::uint64_t met[kWidth];
        rays_meeting(stream_, bundle_, closest_.last, rays, node, slots, met);
        HWY_ALIGN float t_least[kWidth];
        for (std::size_t v = 0; v < kVectors; ++v) store(least[v], t_least + v * kLanes);
        const std::size_t base = size;
        for (; slots != 0; slots &= slots - 1) {
            const int slot = std::countr_zero(slots);
            if (met[slot] == 0) continue;
            insert_sorted(stack, base, size++, Entry{met[slot], node.child[slot], t_least[slot]});
        }
        return size;
    }

    const Bvh& bvh_;
    std::span<const std::uint16_t> order_;
    std::size_t together_;
    RayStream stream_;
    RayBundle bundle_;
    ClosestHits closest_;
    PackedRays packed_;
    SingleRays single_rays_;
};

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif  // per target
