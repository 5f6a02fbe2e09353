// All hits of a ray, one node after the other, with the 16 boxes of a node or the triangles of a
// leaf for lanes.
#if defined(MORPHRAY_CPU_QUERIES_ALL_HITS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_QUERIES_ALL_HITS_INL_H
#undef MORPHRAY_CPU_QUERIES_ALL_HITS_INL_H
#else
#define MORPHRAY_CPU_QUERIES_ALL_HITS_INL_H
#endif

#include <algorithm>
#include <bit>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/bvh/bvh.h"
#include "common/scene_queries.h"
#include "cpu/single_ray/leaf_hit_rule-inl.h"
#include "cpu/single_ray/node_lanes-inl.h"
#include "cpu/single_ray/one_ray-inl.h"

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

/// Calls visit(prim_id, hit) for all triangles of a leaf that a ray hits, in any order.
template <Crossing kCrossing, class Visit>
HWY_INLINE void for_each_hit_of_leaf(const Bvh& bvh, const RayStream& stream, std::size_t ray,
                                     const Leaf& leaf, Visit visit) {
    intersect_leaf<kAnyAxis, kCrossing>(stream, ray, stream.tfar[ray], leaf,
                                        [&](std::uint32_t slot, const TriangleHit& hit) {
                                            visit_repeats(bvh, leaf.prim_id[slot], hit, visit);
                                            return false;
                                        });
}

/// Calls visit(prim_id, hit) for all triangles below a node that a ray hits, in any order.
template <Crossing kCrossing, class Visit>
HWY_INLINE void for_each_hit(const Bvh& bvh, const RayStream& stream, std::size_t ray,
                             std::uint32_t root, Visit visit) {
    const auto met = [&](const Node& node) HWY_ATTR { return met_slots(stream, ray, node); };
    const auto visit_leaf = [&](const Leaf& leaf) HWY_ATTR {
        for_each_hit_of_leaf<kCrossing>(bvh, stream, ray, leaf, visit);
        return true;
    };
    for_each_leaf(bvh, met, visit_leaf, root);
}

template <Crossing kCrossing>
HWY_INLINE std::uint64_t count_hits_of(const Bvh& bvh, const Ray& ray) {
    RayStream stream;
    prepare_one(stream, ray);
    std::uint64_t count = 0;
    for_each_hit<kCrossing>(bvh, stream, 0, 0, [&](std::uint32_t, const TriangleHit&) { ++count; });
    return count;
}

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

template <Crossing kCrossing>
HWY_INLINE void list_hits_of(const Bvh& bvh, const Ray& ray, std::uint32_t most, HitLists& lists) {
    RayStream stream;
    prepare_one(stream, ray);
    const std::size_t first = lists.hits.size();
    // So that a list that is full costs little: twice as many are kept before the rest is dropped.
    const std::size_t room = 2 * std::size_t{most} + 16;
    std::uint64_t total = 0;
    for_each_hit<kCrossing>(bvh, stream, 0, 0, [&](std::uint32_t prim_id, const TriangleHit& hit) {
        ++total;
        if (lists.hits.size() - first == room) keep_first(lists.hits, first, most);
        lists.hits.push_back(make_hit(hit, prim_id));
    });
    keep_first(lists.hits, first, most);
    std::sort(lists.hits.begin() + static_cast<std::ptrdiff_t>(first), lists.hits.end(),
              comes_before);
    lists.listed.push_back(static_cast<std::uint32_t>(lists.hits.size() - first));
    lists.total.push_back(total);
}

/// The first hit, of a ray whose main axis is kAxis, for which takes(t, prim_id) is true.
template <int kAxis, Crossing kCrossing, class Takes>
HWY_NOINLINE Hit first_hit_along(const Bvh& bvh, const RayStream& stream, const Takes& takes) {
    Hit first = no_hit();
    first.t = stream.tfar[0];
    float depth = stream.last_depth[0];
    const auto keep = [&](std::uint32_t prim_id, const TriangleHit& hit) {
        if (!is_closer(hit.t, prim_id, first.t, first.prim_id) || !takes(hit.t, prim_id)) return;
        first = make_hit(hit, prim_id);
        depth = last_depth(hit.t);
    };
    for_each_near_leaf<kAxis>(bvh, stream, 0, depth, [&](const Leaf& leaf) HWY_ATTR {
        intersect_leaf<kAxis, kCrossing>(stream, 0, first.t, leaf,
                                         [&](std::uint32_t slot, const TriangleHit& hit) {
                                             visit_repeats(bvh, leaf.prim_id[slot], hit, keep);
                                             return false;
                                         });
    });
    return first.prim_id == kNoPrim ? no_hit() : first;
}

/// The first hit for which takes(t, prim_id) is true.
template <Crossing kCrossing, class Takes>
HWY_INLINE Hit first_hit_of(const Bvh& bvh, const Ray& ray, const Takes& takes) {
    RayStream stream;
    prepare_one(stream, ray);
    const std::uint32_t axis = stream.axis[0];
    if (axis == 0) return first_hit_along<0, kCrossing>(bvh, stream, takes);
    if (axis == 1) return first_hit_along<1, kCrossing>(bvh, stream, takes);
    return first_hit_along<2, kCrossing>(bvh, stream, takes);
}

/// The first hit after the cursor.
template <Crossing kCrossing>
HWY_INLINE Hit next_hit_of(const Bvh& bvh, const Ray& ray, const HitCursor& after) {
    Ray rest = ray;
    rest.tnear = std::max(ray.tnear, after.t);
    if (!(rest.tnear <= rest.tfar)) return no_hit();
    return first_hit_of<kCrossing>(bvh, rest, [&after](float t, std::uint32_t prim_id) {
        return is_closer(after.t, after.prim_id, t, prim_id);
    });
}

/// The closest hit with a mesh that is visible.
HWY_INLINE Hit visible_hit_of(const Bvh& bvh, const Ray& ray, const VisibleMeshes& meshes) {
    return first_hit_of<Crossing::kEach>(
        bvh, ray, [&meshes](float, std::uint32_t prim_id) { return meshes.sees(prim_id); });
}

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif  // per target
