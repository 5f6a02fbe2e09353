// The points and rays of queries about all triangles.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "common/interop/ray.h"
#include "lab/bench/bench_scene.h"

namespace mray::lab {

/// Points in any order in the box of all finite vertices. The same on each call.
std::vector<vec3> points_in_box(const BenchScene& scene, std::size_t count);
/// Points up to 1 % of the box's longest side away from places spread over the triangles.
std::vector<vec3> points_near_surface(const BenchScene& scene, std::size_t count);

/// Rays without an end from points_in_box() in directions of all kinds, in any order.
std::vector<Ray> random_rays(const BenchScene& scene, std::size_t count);
std::vector<Ray> rays_up(std::span<const vec3> points);

}  // namespace mray::lab
