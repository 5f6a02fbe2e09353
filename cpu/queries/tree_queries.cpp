#include "cpu/queries/tree_queries.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "cpu/queries/tree_queries.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "cpu/queries/tree_queries-inl.h"

#if HWY_ONCE

#include "common/simd/simd_dispatch-inl.h"

namespace mray::cpu {
namespace {

HWY_EXPORT(answer_batch);
HWY_EXPORT(place_points);

}  // namespace

TreeQueries::TreeQueries(const Bvh& bvh, SimdTarget target)
    : bvh_(&bvh), answer_(SIMD_FUNCTION(answer_batch, target)) {}

void find_places(SimdTarget target, std::span<const vec3> points,
                 std::span<const ClosestTriangle> closest, std::span<const uvec3> triangles,
                 std::span<const vec3> positions, std::span<NearPoint> places) {
    assert(points.size() == closest.size() && points.size() == places.size());
    SIMD_FUNCTION(place_points, target)(points, closest, triangles, positions, places);
}

}  // namespace mray::cpu

#endif  // HWY_ONCE
