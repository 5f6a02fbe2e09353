// The points and rays of queries about all triangles.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include <glm/geometric.hpp>

#include "common/interop/ray.h"
#include "lab/bench/bench_scene.h"

namespace mray::bench {

/// The point of a scene that is closest to the point of a query, as peers store it.
struct NearestPoint {
    vec3 point;
    float distance;
    std::uint32_t prim_id;
};

/// Finds the closest point to each, in the calling thread's arena.
using FindClosest = std::function<void(std::span<const vec3>, std::span<NearestPoint>)>;

/// CGAL's AABB_tree without exact arithmetic, with the tree of vertices for first guesses.
struct CgalPeer {
    /// "CGAL 5.5.1 AABB_tree"
    std::string name;
    /// By closest_point_and_primitive(). Empty without CGAL's headers or without triangles.
    FindClosest find_closest;
};
#ifdef MORPHRAY_CGAL
CgalPeer make_cgal_peer(const BenchScene& scene);
#else
inline CgalPeer make_cgal_peer(const BenchScene&) { return {}; }
#endif

/// Points in any order in the box of all finite vertices. The same on each call.
std::vector<vec3> points_in_box(const BenchScene& scene, std::size_t count);
/// Points up to 1 % of the box's longest side away from places spread over the triangles.
std::vector<vec3> points_near_surface(const BenchScene& scene, std::size_t count);

/// Rays without an end from points_in_box() in directions of all kinds, in any order.
std::vector<Ray> random_rays(const BenchScene& scene, std::size_t count);
std::vector<Ray> rays_up(std::span<const vec3> points);

/// The point of the triangle a, b, c that is closest to p, in plain floats (C. Ericson. Real-Time
/// Collision Detection, 2005, 5.1.5).
inline vec3 ericson_closest_point(vec3 p, vec3 a, vec3 b, vec3 c) {
    const vec3 ab = b - a;
    const vec3 ac = c - a;
    const vec3 ap = p - a;
    const float d1 = glm::dot(ab, ap);
    const float d2 = glm::dot(ac, ap);
    if (d1 <= 0 && d2 <= 0) return a;
    const vec3 bp = p - b;
    const float d3 = glm::dot(ab, bp);
    const float d4 = glm::dot(ac, bp);
    if (d3 >= 0 && d4 <= d3) return b;
    const float vc = d1 * d4 - d3 * d2;
    if (vc <= 0 && d1 >= 0 && d3 <= 0) return a + (d1 / (d1 - d3)) * ab;
    const vec3 cp = p - c;
    const float d5 = glm::dot(ab, cp);
    const float d6 = glm::dot(ac, cp);
    if (d6 >= 0 && d5 <= d6) return c;
    const float vb = d5 * d2 - d1 * d6;
    if (vb <= 0 && d2 >= 0 && d6 <= 0) return a + (d2 / (d2 - d6)) * ac;
    const float va = d3 * d6 - d5 * d4;
    if (va <= 0 && d4 >= d3 && d5 >= d6) return b + ((d4 - d3) / ((d4 - d3) + (d5 - d6))) * (c - b);
    const float scale = 1 / (va + vb + vc);
    return a + (vb * scale) * ab + (vc * scale) * ac;
}

}  // namespace mray::bench
