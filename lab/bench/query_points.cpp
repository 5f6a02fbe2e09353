#include "lab/bench/query_points.h"

#include <algorithm>
#include <glm/geometric.hpp>

#include "common/bvh/box.h"

namespace mray::lab {
namespace {

/// Numbers of a fixed sequence.
class Numbers {
public:
    /// In [0, 1).
    float next() {
        state_ = state_ * 6364136223846793005u + 1442695040888963407u;
        return static_cast<float>(state_ >> 40) * 0x1p-24f;
    }
    std::size_t below(std::size_t count) {
        const auto index = static_cast<std::size_t>(double{next()} * static_cast<double>(count));
        return std::min(index, count - 1);
    }
    /// In [-1, 1) on each axis.
    vec3 offset() {
        const float x = 2 * next() - 1;
        const float y = 2 * next() - 1;
        const float z = 2 * next() - 1;
        return {x, y, z};
    }

private:
    std::uint64_t state_ = 1;
};

Box box_of_vertices(const BenchScene& scene) {
    Box box;
    for (const vec3& p : scene.positions)
        if (is_finite_vertex(p)) box.extend(p);
    return box;
}

vec3 point_in(const Box& box, Numbers& numbers) {
    return box.lower + (box.upper - box.lower) * (0.5f * (numbers.offset() + vec3(1, 1, 1)));
}

}  // namespace

std::vector<vec3> points_in_box(const BenchScene& scene, std::size_t count) {
    const Box box = box_of_vertices(scene);
    Numbers numbers;
    std::vector<vec3> points(count);
    for (vec3& p : points) p = point_in(box, numbers);
    return points;
}

std::vector<vec3> points_near_surface(const BenchScene& scene, std::size_t count) {
    const std::vector<uvec3>& triangles = scene.topology().triangles;
    const Box box = box_of_vertices(scene);
    const vec3 sides = box.upper - box.lower;
    const float reach = 0.01f * std::max({sides.x, sides.y, sides.z});
    Numbers numbers;
    std::vector<vec3> points(count);
    for (vec3& point : points) {
        const uvec3 t = triangles[numbers.below(triangles.size())];
        float u = numbers.next();
        float v = numbers.next();
        if (u + v > 1) {
            u = 1 - u;
            v = 1 - v;
        }
        const vec3 a = scene.positions[t.x];
        const vec3 b = scene.positions[t.y];
        const vec3 c = scene.positions[t.z];
        const vec3 offset = reach * numbers.offset();
        const bool finite = is_finite_vertex(a) && is_finite_vertex(b) && is_finite_vertex(c);
        point = (finite ? a + u * (b - a) + v * (c - a) : vec3(0, 0, 0)) + offset;
    }
    return points;
}

std::vector<Ray> random_rays(const BenchScene& scene, std::size_t count) {
    const Box box = box_of_vertices(scene);
    Numbers numbers;
    std::vector<Ray> rays(count);
    for (Ray& ray : rays) {
        const vec3 org = point_in(box, numbers);
        vec3 dir = numbers.offset();
        while (glm::dot(dir, dir) > 1 || glm::dot(dir, dir) < 0.01f) dir = numbers.offset();
        ray = {org, 0, dir, kInfiniteT};
    }
    return rays;
}

std::vector<Ray> rays_up(std::span<const vec3> points) {
    std::vector<Ray> rays;
    rays.reserve(points.size());
    for (const vec3& p : points) rays.push_back({p, 0, {0, 0, 1}, kInfiniteT});
    return rays;
}

}  // namespace mray::lab
