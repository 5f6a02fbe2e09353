// All hits of rays: of one ray with the 16 boxes of a node or the triangles of a leaf for lanes,
// and their numbers for rays together.
#if defined(MORPHRAY_CPU_QUERIES_ALL_HITS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_QUERIES_ALL_HITS_INL_H
#undef MORPHRAY_CPU_QUERIES_ALL_HITS_INL_H
#else
#define MORPHRAY_CPU_QUERIES_ALL_HITS_INL_H
#endif

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/bvh/bvh.h"
#include "common/scene_queries.h"
#include "cpu/single_ray/closest_leaf-inl.h"
#include "cpu/single_ray/leaf_hit_rule-inl.h"
#include "cpu/single_ray/node_lanes-inl.h"
#include "cpu/single_ray/ray_stream-inl.h"
#include "cpu/single_ray/walks-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

/// Calls visit(prim_id, hit) for a triangle and those that it stands for.
template <class Visit>
HWY_INLINE void visit_repeats(const Bvh& bvh, std::uint32_t prim_id, const TriangleHit& hit,
                              Visit& visit) {
    visit(prim_id, hit);
    if (bvh.repeated.empty()) [[likely]]
        return;
    for (const RepeatedTriangle& repeated : repeats_of(bvh, prim_id)) visit(repeated.prim_id, hit);
}

/// Calls visit(prim_id, hit) for all triangles of a leaf that a ray hits no later than tfar, in any
/// order. kAxis is the ray's main axis, or kAnyAxis.
template <int kAxis = kAnyAxis, class Visit>
HWY_INLINE void for_each_hit_of_leaf(const Bvh& bvh, const RayStream& stream, std::size_t ray,
                                     float tfar, const Leaf& leaf, Visit visit) {
    intersect_leaf<kAxis>(stream, ray, tfar, leaf, [&](std::uint32_t slot, const TriangleHit& hit) {
        visit_repeats(bvh, leaf.prim_id[slot], hit, visit);
        return false;
    });
}

/// Calls visit(prim_id, hit) for all triangles below a node that a ray hits, in any order.
template <class Visit>
HWY_INLINE void for_each_hit(const Bvh& bvh, const RayStream& stream, std::size_t ray,
                             std::uint32_t root, Visit visit) {
    const auto met = [&](const Node& node) HWY_ATTR { return met_slots(stream, ray, node); };
    const auto visit_leaf = [&](const Leaf& leaf) HWY_ATTR {
        for_each_hit_of_leaf(bvh, stream, ray, stream.tfar[ray], leaf, visit);
        return true;
    };
    for_each_leaf(bvh, met, visit_leaf, root);
}

/// The number of hits with one more, and kTouchesBorder.
HWY_INLINE std::uint64_t with_hit(std::uint64_t count, const TriangleHit& hit) {
    return (count + 1) | (may_touch_border(hit) ? kTouchesBorder : 0);
}

HWY_INLINE std::uint64_t count_hits_of(const Bvh& bvh, const Ray& ray, Crossing crossing) {
    RayStream stream;
    prepare_one(stream, ray);
    stream.crossing = crossing;
    std::uint64_t count = 0;
    for_each_hit(bvh, stream, 0, 0,
                 [&](std::uint32_t, const TriangleHit& hit) { count = with_hit(count, hit); });
    return count;
}

// Counted rays go on together below a node if they are more than this many.
inline constexpr std::size_t kCountedTogether = kLanes < 8 ? 4 : 8;

/// The numbers of hits of up to 64 rays of one octant, which go down the tree together; where few
/// are left they go on alone.
class CountStream {
public:
    /// rays[order[i]], of one octant: at least one and at most kStreamRays.
    HWY_INLINE CountStream(const Bvh& bvh, const Ray* rays, std::span<const std::uint16_t> order,
                           Crossing crossing)
        : bvh_(bvh), order_(order), stream_(make_stream(rays, order)) {
        stream_.crossing = crossing;
        for (std::size_t i = 0; i < kStreamRays; i += kLanes) store(splat(0u), counts_ + i);
    }

    /// Sets counts[order[i]].
    HWY_INLINE void count(std::uint64_t* counts) {
        if (order_.size() > kCountedTogether) {
            walk_together(bvh_, stream_, order_.size(), *this);
        } else {
            part(~std::uint64_t{0} >> (kStreamRays - order_.size()), 0);
        }
        for (std::size_t i = 0; i < order_.size(); ++i) {
            const bool touches = (counts_[i] & kTouches) != 0;
            counts[order_[i]] = (counts_[i] & ~kTouches) | (touches ? kTouchesBorder : 0);
        }
    }

    // For walk_together().
    static constexpr bool kFrontToBack = false;
    HWY_INLINE const float* last_depths() const { return stream_.last_depth; }
    HWY_INLINE std::uint64_t rays_left(std::uint64_t rays, float) const { return rays; }
    HWY_INLINE bool stay_together(std::uint64_t rays) const {
        return static_cast<std::size_t>(std::popcount(rays)) > kCountedTogether;
    }
    HWY_INLINE void part(std::uint64_t rays, std::uint32_t child) {
        for (; rays != 0; rays &= rays - 1) {
            const auto ray = static_cast<std::size_t>(std::countr_zero(rays));
            for_each_hit(bvh_, stream_, ray, child,
                         [&](std::uint32_t, const TriangleHit& hit) { add_one(ray, hit); });
        }
    }
    HWY_INLINE void visit_leaf(std::uint64_t rays, const Leaf& leaf) {
        for_rays_of_leaf(
            rays,
            [&](std::size_t first, std::uint32_t asked) HWY_ATTR {
                intersect_leaf_together(
                    stream_, first, asked, stream_.tfar, leaf,
                    [&](Mask hits, const lanes::TriangleHit& hit, std::uint32_t prim_id)
                        HWY_ATTR { add(first, hits, hit, prim_id); });
            },
            [&](std::size_t ray) HWY_ATTR {
                for_each_hit_of_leaf(
                    bvh_, stream_, ray, stream_.tfar[ray], leaf,
                    [&](std::uint32_t, const TriangleHit& hit) { add_one(ray, hit); });
            });
    }

private:
    /// kTouchesBorder of a count; there are fewer triangles.
    static constexpr std::uint32_t kTouches = 1u << 31;

    HWY_INLINE void add_one(std::size_t ray, const TriangleHit& hit) {
        counts_[ray] = (counts_[ray] + 1) | (may_touch_border(hit) ? kTouches : 0);
    }
    HWY_INLINE void add(std::size_t first, Mask hits, const lanes::TriangleHit& hit,
                        std::uint32_t prim_id) {
        std::uint32_t times = 1;
        if (!bvh_.repeated.empty())
            times += static_cast<std::uint32_t>(repeats_of(bvh_, prim_id).size());
        const UintVec more = select(uint_mask(hits), splat(times), splat(0u));
        const Mask touches = hits & lanes::may_touch_border(hit);
        const UintVec flags = select(uint_mask(touches), splat(kTouches), splat(0u));
        store((load(counts_ + first) + more) | flags, counts_ + first);
    }

    const Bvh& bvh_;
    std::span<const std::uint16_t> order_;
    RayStream stream_;
    alignas(64) std::uint32_t counts_[kStreamRays];
};

inline bool comes_before(const Hit& a, const Hit& b) {
    return is_closer(a.t, a.prim_id, b.t, b.prim_id);
}

/// Keeps the first `most` of the hits from `first` on, in any order.
inline void keep_first(std::vector<Hit>& hits, std::size_t first, std::size_t most) {
    if (hits.size() - first <= most) return;
    const auto begin = hits.begin() + static_cast<std::ptrdiff_t>(first);
    std::nth_element(begin, begin + static_cast<std::ptrdiff_t>(most), hits.end(), comes_before);
    hits.resize(first + most);
}

HWY_INLINE void list_hits_of(const Bvh& bvh, const Ray& ray, Crossing crossing, std::uint32_t most,
                             HitLists& lists) {
    RayStream stream;
    prepare_one(stream, ray);
    stream.crossing = crossing;
    const std::size_t first = lists.hits.size();
    // So that a list that is full costs little: twice as many are kept before the rest is dropped.
    const std::size_t room = 2 * std::size_t{most} + 16;
    std::uint64_t total = 0;
    for_each_hit(bvh, stream, 0, 0, [&](std::uint32_t prim_id, const TriangleHit& hit) {
        total = with_hit(total, hit);
        if (lists.hits.size() - first == room) keep_first(lists.hits, first, most);
        lists.hits.push_back(make_hit(hit, prim_id));
    });
    keep_first(lists.hits, first, most);
    std::sort(lists.hits.begin() + static_cast<std::ptrdiff_t>(first), lists.hits.end(),
              comes_before);
    lists.listed.push_back(static_cast<std::uint32_t>(lists.hits.size() - first));
    lists.total.push_back(total);
}

/// The first hit after the cursor of a ray whose main axis is kAxis.
template <int kAxis>
HWY_NOINLINE Hit next_hit_along(const Bvh& bvh, const RayStream& stream, const HitCursor& after) {
    Hit first = no_hit();
    first.t = stream.tfar[0];
    float depth = stream.last_depth[0];
    const auto keep = [&](std::uint32_t prim_id, const TriangleHit& hit) {
        if (!is_closer(hit.t, prim_id, first.t, first.prim_id) ||
            !is_closer(after.t, after.prim_id, hit.t, prim_id))
            return;
        first = make_hit(hit, prim_id);
        depth = last_depth(hit.t);
    };
    for_each_near_leaf<kAxis>(bvh, stream, 0, depth, [&](const Leaf& leaf) HWY_ATTR {
        for_each_hit_of_leaf<kAxis>(bvh, stream, 0, first.t, leaf, keep);
    });
    return first.prim_id == kNoPrim ? no_hit() : first;
}

/// The first hit after the cursor.
HWY_INLINE Hit next_hit_of(const Bvh& bvh, Ray ray, Crossing crossing, const HitCursor& after) {
    ray.tnear = std::max(ray.tnear, after.t);
    if (!(ray.tnear <= ray.tfar)) return no_hit();
    RayStream stream;
    prepare_one(stream, ray);
    stream.crossing = crossing;
    const std::uint32_t axis = stream.axis[0];
    if (axis == 0) return next_hit_along<0>(bvh, stream, after);
    if (axis == 1) return next_hit_along<1>(bvh, stream, after);
    return next_hit_along<2>(bvh, stream, after);
}

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif  // per target
