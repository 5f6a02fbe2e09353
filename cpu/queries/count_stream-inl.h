// Numbers of hits of a stream of up to 64 rays of one octant.
//
// The rays go down the tree together, with a mask of rays for each entry of the stack, as in
// cpu/single_ray/stream_closest-inl.h, but in no order: no hit shortens a ray. Where few rays are
// left they go on alone.
#if defined(MORPHRAY_CPU_QUERIES_COUNT_STREAM_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_QUERIES_COUNT_STREAM_INL_H
#undef MORPHRAY_CPU_QUERIES_COUNT_STREAM_INL_H
#else
#define MORPHRAY_CPU_QUERIES_COUNT_STREAM_INL_H
#endif

#include <bit>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <span>

#include "common/bvh/bvh.h"
#include "common/scene_queries.h"
#include "cpu/queries/all_hits-inl.h"
#include "cpu/single_ray/closest_leaf-inl.h"
#include "cpu/single_ray/ray_bundle-inl.h"
#include "cpu/single_ray/ray_stream-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

// Rays go on together below a node if they are more than this many, and a vector of rays in a leaf
// if it has more than this many of them.
inline constexpr std::size_t kCountedTogether = kLanes < 8 ? 4 : 8;
inline constexpr std::size_t kCountedInLeaf = kLanes < 8 ? kLanes / 2 + 1 : kLanes == 8 ? 3 : 6;

template <Crossing kCrossing>
class CountStream {
public:
    /// rays[order[i]], of one octant: at least one and at most kStreamRays.
    HWY_INLINE CountStream(const Bvh& bvh, const Ray* rays, std::span<const std::uint16_t> order)
        : bvh_(bvh), order_(order), stream_(make_stream(rays, order)) {
        for (std::size_t i = 0; i < kStreamRays; i += kLanes) store(splat(0u), counts_ + i);
    }

    /// Sets counts[order[i]].
    HWY_INLINE void count(std::uint64_t* counts) {
        const std::uint64_t all = ~std::uint64_t{0} >> (kStreamRays - order_.size());
        if (order_.size() > kCountedTogether) {
            descend(all);
        } else {
            count_alone(all, 0);
        }
        for (std::size_t i = 0; i < order_.size(); ++i) counts[order_[i]] = counts_[i];
    }

private:
    struct Entry {
        std::uint64_t rays;
        std::uint32_t child;
    };

    HWY_INLINE void descend(std::uint64_t all) {
        const std::size_t count = order_.size();
        const RayBundle bundle = bundle_of(stream_, count);
        const float end = last_entry(bundle.depth_margin, largest_of(stream_.last_depth, count));
        Entry stack[kMaxStack];
        stack[0] = {all, 0};
        for (std::size_t size = 1; size > 0;) {
            const Entry entry = stack[--size];
            if ((entry.child & kLeafBit) != 0) {
                count_in_leaf(entry.rays, bvh_.leaves[entry.child & ~kLeafBit]);
                continue;
            }
            if (static_cast<std::size_t>(std::popcount(entry.rays)) <= kCountedTogether) {
                count_alone(entry.rays, entry.child);
                continue;
            }
            const Node& node = bvh_.nodes[entry.child];
            std::uint64_t met[kWidth];
            std::uint32_t slots = met_slots(bundle, end, node);
            rays_meeting(stream_, bundle, stream_.last_depth, entry.rays, node, slots, met);
            for (; slots != 0; slots &= slots - 1) {
                const int slot = std::countr_zero(slots);
                assert(size < kMaxStack);
                stack[size] = {met[slot], node.child[slot]};
                size += met[slot] != 0;
            }
        }
    }

    HWY_INLINE void count_in_leaf(std::uint64_t rays, const Leaf& leaf) {
        for (std::size_t first = 0; first < kStreamRays; first += kLanes) {
            auto asked = static_cast<std::uint32_t>(rays >> first & kLaneBits);
            if (static_cast<std::size_t>(std::popcount(asked)) > kCountedInLeaf) {
                intersect_leaf_together<kCrossing>(
                    stream_, first, asked, stream_.tfar, leaf,
                    [&](Mask hits, const lanes::TriangleHit&, std::uint32_t prim_id)
                        HWY_ATTR { add(first, hits, prim_id); });
                continue;
            }
            for (; asked != 0; asked &= asked - 1) {
                const std::size_t ray = first + static_cast<std::size_t>(std::countr_zero(asked));
                for_each_hit_of_leaf<kCrossing>(
                    bvh_, stream_, ray, leaf,
                    [&](std::uint32_t, const TriangleHit&) { ++counts_[ray]; });
            }
        }
    }

    HWY_INLINE void add(std::size_t first, Mask hits, std::uint32_t prim_id) {
        std::uint32_t times = 1;
        if (!bvh_.repeated.empty())
            times += static_cast<std::uint32_t>(repeats_of(bvh_, prim_id).size());
        const UintVec more = select(uint_mask(hits), splat(times), splat(0u));
        store(load(counts_ + first) + more, counts_ + first);
    }

    HWY_INLINE void count_alone(std::uint64_t rays, std::uint32_t child) {
        for (; rays != 0; rays &= rays - 1) {
            const auto ray = static_cast<std::size_t>(std::countr_zero(rays));
            for_each_hit<kCrossing>(bvh_, stream_, ray, child,
                                    [&](std::uint32_t, const TriangleHit&) { ++counts_[ray]; });
        }
    }

    const Bvh& bvh_;
    std::span<const std::uint16_t> order_;
    RayStream stream_;
    alignas(64) std::uint32_t counts_[kStreamRays];
};

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif  // per target
