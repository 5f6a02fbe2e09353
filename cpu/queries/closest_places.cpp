#include "cpu/queries/closest_places.h"

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <cstdint>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "cpu/queries/closest_places.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "cpu/queries/rule_lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

void place_points(std::span<const vec3> points, std::span<const ClosestTriangle> closest,
                  std::span<const uvec3> triangles, std::span<const vec3> positions,
                  std::span<NearPoint> places) {
    /// A point and the vertices of its triangle, in lanes.
    struct Corners {
        HWY_ALIGN float lane[4][3][kLanes];

        HWY_INLINE void set(int corner, std::size_t i, const vec3& p) {
            for (int axis = 0; axis < 3; ++axis) lane[corner][axis][i] = p[axis];
        }
        HWY_INLINE lanes::Float3 get(int corner) const {
            return {load(lane[corner][0]), load(lane[corner][1]), load(lane[corner][2])};
        }
    };
    for (std::size_t first = 0; first < points.size(); first += kLanes) {
        const std::size_t count = std::min<std::size_t>(kLanes, points.size() - first);
        Corners corners;
        for (std::size_t i = 0; i < kLanes; ++i) {
            // Lanes without a point have the last one.
            const std::size_t at = first + std::min(i, count - 1);
            corners.set(3, i, points[at]);
            const std::uint32_t prim_id = closest[at].prim_id;
            for (int k = 0; k < 3; ++k) {
                const bool is_any = prim_id != kNoPrim;
                corners.set(k, i, is_any ? positions[triangles[prim_id][k]] : points[at]);
            }
        }
        const lanes::NearPoint near = lanes::closest_on_triangle(corners.get(3), corners.get(0),
                                                                 corners.get(1), corners.get(2));
        HWY_ALIGN float values[6][kLanes];
        store(near.d2, values[0]);
        store(near.u, values[1]);
        store(near.v, values[2]);
        store(near.offset.x, values[3]);
        store(near.offset.y, values[4]);
        store(near.offset.z, values[5]);
        for (std::size_t i = 0; i < count; ++i) {
            places[first + i] = {values[0][i],
                                 values[1][i],
                                 values[2][i],
                                 {values[3][i], values[4][i], values[5][i]}};
        }
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

#include "common/simd/simd_dispatch-inl.h"

namespace mray::cpu {

HWY_EXPORT(place_points);

void find_places(SimdTarget target, std::span<const vec3> points,
                 std::span<const ClosestTriangle> closest, std::span<const uvec3> triangles,
                 std::span<const vec3> positions, std::span<NearPoint> places) {
    assert(points.size() == closest.size() && points.size() == places.size());
    SIMD_FUNCTION(place_points, target)(points, closest, triangles, positions, places);
}

}  // namespace mray::cpu

#endif  // HWY_ONCE
