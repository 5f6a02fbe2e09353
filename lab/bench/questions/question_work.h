// The points and rays that questions about all triangles are asked with, and how answers compare.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/interop/ray.h"
#include "common/scene/mesh.h"
#include "lab/bench/bench_scene.h"
#include "lab/bench/compare_answers.h"

namespace mray::bench {

/// The point of a scene that is closest to a point asked about, as peers store it.
struct NearestPoint {
    vec3 point;
    float distance;
    std::uint32_t prim_id;
};

/// Points in any order in the box of all finite vertices. The same on each call.
std::vector<vec3> points_in_box(const BenchScene& scene, std::size_t count);
/// Points in any order that are up to 1 % of the longest side of that box away, along each axis,
/// from places that are spread over the triangles, as many on each. The same on each call.
std::vector<vec3> points_near_surface(const BenchScene& scene, std::size_t count);

/// The points along a Morton curve over their box, so that neighbours are near each other.
std::vector<vec3> sorted_by_place(std::vector<vec3> points);

/// Rays without an end from points_in_box() in directions of all kinds, in any order.
std::vector<Ray> random_rays(const BenchScene& scene, std::size_t count);
/// The half-lines from points along +z.
std::vector<Ray> rays_up(std::span<const vec3> points);

/// Distances that differ by more than this part of the scene's extent count as different.
inline constexpr double kMostDifference = 1e-6;

/// How far distances to the closest points are apart.
struct DistanceDifference {
    /// Those that differ by more than kMostDifference.
    std::uint64_t count = 0;
    /// As a part of the scene's extent; infinite if one side has no answer.
    double largest = 0;

    void add(float a, float b);
};

}  // namespace mray::bench
