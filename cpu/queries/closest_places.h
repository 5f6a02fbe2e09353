// The places of closest triangles that the points of a call are nearest to.
#pragma once

#include <span>

#include "common/interop/closest_rule.h"
#include "common/scene_queries.h"
#include "common/simd/simd_target.h"

namespace mray::cpu {

/// Sets places[i] to closest_on_triangle() of points[i] and the triangle closest[i], with its bits;
/// to any place if there is none. Scene space.
void find_places(SimdTarget target, std::span<const vec3> points,
                 std::span<const ClosestTriangle> closest, std::span<const uvec3> triangles,
                 std::span<const vec3> positions, std::span<NearPoint> places);

}  // namespace mray::cpu
