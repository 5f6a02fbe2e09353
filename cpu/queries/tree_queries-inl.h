// The entries of cpu/queries/tree_queries.h, compiled once for each target.
#if defined(MORPHRAY_CPU_QUERIES_TREE_QUERIES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_QUERIES_TREE_QUERIES_INL_H
#undef MORPHRAY_CPU_QUERIES_TREE_QUERIES_INL_H
#else
#define MORPHRAY_CPU_QUERIES_TREE_QUERIES_INL_H
#endif

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/bvh/bvh.h"
#include "common/scene_queries.h"
#include "cpu/queries/all_hits-inl.h"
#include "cpu/queries/point_bundle-inl.h"
#include "cpu/queries/points-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

void count_hits(const Bvh& bvh, std::span<const Ray> rays, Crossing crossing,
                std::span<std::uint64_t> counts) {
    for (std::size_t i = 0; i < rays.size(); ++i) {
        counts[i] = crossing == Crossing::kOwner ? count_hits_of<Crossing::kOwner>(bvh, rays[i])
                                                 : count_hits_of<Crossing::kEach>(bvh, rays[i]);
    }
}

void list_hits(const Bvh& bvh, std::span<const Ray> rays, Crossing crossing, std::uint32_t most,
               HitLists& lists) {
    for (const Ray& ray : rays) {
        if (crossing == Crossing::kOwner) {
            list_hits_of<Crossing::kOwner>(bvh, ray, most, lists);
        } else {
            list_hits_of<Crossing::kEach>(bvh, ray, most, lists);
        }
    }
}

void find_next_hits(const Bvh& bvh, std::span<const Ray> rays, std::span<const HitCursor> after,
                    Crossing crossing, std::span<Hit> hits) {
    for (std::size_t i = 0; i < rays.size(); ++i) {
        hits[i] = crossing == Crossing::kOwner
                      ? next_hit_of<Crossing::kOwner>(bvh, rays[i], after[i])
                      : next_hit_of<Crossing::kEach>(bvh, rays[i], after[i]);
    }
}

void wind_points(const Bvh& bvh, std::span<const vec3> points, std::span<FloatWinding> windings,
                 std::vector<UncertainCrossing>& uncertain) {
    for (std::size_t i = 0; i < points.size(); ++i) {
        windings[i] = wind_around(bvh, points[i], [&](std::uint32_t prim_id) {
            uncertain.push_back({static_cast<std::uint32_t>(i), prim_id});
        });
    }
}

/// Looks for closer triangles than `closest`, one point after the other. Returns the leaves
/// visited.
HWY_INLINE std::size_t find_closest_of_each(const Bvh& bvh, std::span<const vec3> points,
                                            std::uint32_t& near_leaf,
                                            std::span<ClosestTriangle> closest) {
    std::size_t leaves = 0;
    for (std::size_t i = 0; i < points.size(); ++i)
        leaves += find_closest(bvh, points[i], near_leaf, closest[i]);
    return leaves;
}

void find_closest_triangles(const Bvh& bvh, std::span<const vec3> points, float most_d2,
                            std::span<ClosestTriangle> closest) {
    std::fill(closest.begin(), closest.end(), ClosestTriangle{most_d2, kNoPrim});
    std::uint32_t near_leaf = kNoPrim;
#if HWY_TARGET != HWY_SCALAR
    // Fewer are asked about in any order.
    constexpr std::size_t kManyPoints = 256;
    if (points.size() >= kManyPoints) {
        BundleChoice choice;
        for (std::size_t first = 0; first < points.size(); first += kLanes) {
            const std::size_t count = std::min<std::size_t>(kLanes, points.size() - first);
            const std::span<const vec3> asked = points.subspan(first, count);
            const std::span<ClosestTriangle> found = closest.subspan(first, count);
            if (choice.tries()) {
                PointBundle bundle(bvh, asked, most_d2);
                const bool is_done = bundle.search(choice.most_leaves(), near_leaf);
                bundle.store_closest(found);
                if (is_done) {
                    choice.succeeded();
                    continue;
                }
                choice.gave_up();
            }
            choice.add(count, find_closest_of_each(bvh, asked, near_leaf, found));
        }
        return;
    }
#endif
    find_closest_of_each(bvh, points, near_leaf, closest);
}

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif  // per target
