#include "cpu/queries/tree_queries.h"

#include <cassert>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "cpu/queries/tree_queries.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "cpu/queries/tree_queries-inl.h"

#if HWY_ONCE

#include "common/simd/simd_dispatch-inl.h"

namespace mray::cpu {
namespace {

HWY_EXPORT(count_hits);
HWY_EXPORT(list_hits);
HWY_EXPORT(find_next_hits);
HWY_EXPORT(find_visible_hits);
HWY_EXPORT(wind_points);
HWY_EXPORT(find_closest_triangles);
HWY_EXPORT(place_points);

}  // namespace

TreeQueries::TreeQueries(const Bvh& bvh, SimdTarget target)
    : bvh_(&bvh),
      count_(SIMD_FUNCTION(count_hits, target)),
      list_(SIMD_FUNCTION(list_hits, target)),
      after_(SIMD_FUNCTION(find_next_hits, target)),
      visible_(SIMD_FUNCTION(find_visible_hits, target)),
      wind_(SIMD_FUNCTION(wind_points, target)),
      closest_(SIMD_FUNCTION(find_closest_triangles, target)) {}

void TreeQueries::count(std::span<const Ray> rays, Crossing crossing,
                        std::span<std::uint64_t> counts) const {
    assert(rays.size() == counts.size());
    count_(*bvh_, rays, crossing, counts);
}

void TreeQueries::list(std::span<const Ray> rays, Crossing crossing, std::uint32_t most,
                       HitLists& lists) const {
    list_(*bvh_, rays, crossing, most, lists);
}

void TreeQueries::intersect_after(std::span<const Ray> rays, std::span<const HitCursor> after,
                                  Crossing crossing, std::span<Hit> hits) const {
    assert(rays.size() == hits.size() && rays.size() == after.size());
    after_(*bvh_, rays, after, crossing, hits);
}

void TreeQueries::intersect_visible(std::span<const Ray> rays, const VisibleMeshes& meshes,
                                    std::span<Hit> hits) const {
    assert(rays.size() == hits.size());
    visible_(*bvh_, rays, meshes, hits);
}

void TreeQueries::wind(std::span<const vec3> points, std::span<FloatWinding> windings,
                       std::vector<UncertainCrossing>& uncertain) const {
    assert(points.size() == windings.size());
    wind_(*bvh_, points, windings, uncertain);
}

void TreeQueries::closest(std::span<const vec3> points, float most_d2,
                          std::span<ClosestTriangle> closest) const {
    assert(points.size() == closest.size());
    closest_(*bvh_, points, most_d2, closest);
}

void find_places(SimdTarget target, std::span<const vec3> points,
                 std::span<const ClosestTriangle> closest, std::span<const uvec3> triangles,
                 std::span<const vec3> positions, std::span<NearPoint> places) {
    assert(points.size() == closest.size() && points.size() == places.size());
    SIMD_FUNCTION(place_points, target)(points, closest, triangles, positions, places);
}

}  // namespace mray::cpu

#endif  // HWY_ONCE
