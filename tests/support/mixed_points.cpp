#include "tests/support/mixed_points.h"

#include <cmath>

#include "common/bvh/box.h"

namespace mray::test {
namespace {

/// v with each component moved by up to `ulps` ulp, on the grid of scene space.
vec3 nudged(vec3 v, std::uint32_t ulps, Random& random) {
    for (int axis = 0; axis < 3; ++axis) {
        for (std::uint32_t i = random.below(ulps + 1); i > 0; --i)
            v[axis] = std::nextafter(v[axis], random.below(2) == 0 ? -1e30f : 1e30f);
    }
    return snap_point(v);
}

vec3 mean(vec3 a, vec3 b, vec3 c, double u, double v) {
    const double w = 1 - u - v;
    vec3 p;
    for (int axis = 0; axis < 3; ++axis) {
        p[axis] =
            static_cast<float>(w * static_cast<double>(a[axis]) + u * static_cast<double>(b[axis]) +
                               v * static_cast<double>(c[axis]));
    }
    return snap_point(p);
}

}  // namespace

std::vector<vec3> mixed_points(const std::vector<uvec3>& triangles,
                               const std::vector<vec3>& positions, std::size_t count,
                               std::uint64_t seed) {
    Random random(seed);
    Box box;
    for (const vec3& p : positions)
        if (is_finite_vertex(p)) box.extend(p);
    if (box.empty()) box.extend({0, 0, 0});
    const auto in_box = [&](double margin) {
        vec3 p;
        for (int axis = 0; axis < 3; ++axis) {
            const double lower = box.lower[axis];
            const double upper = box.upper[axis];
            const double more = margin * (upper - lower);
            p[axis] = static_cast<float>(random.real(lower - more, upper + more));
        }
        return snap_point(p);
    };
    const auto finite_vertex = [&](std::uint32_t i) {
        return is_finite_vertex(positions[i]) ? positions[i] : vec3(1, 2, 3);
    };
    std::vector<vec3> points;
    while (points.size() < count) {
        if (triangles.empty()) {
            points.push_back(in_box(1));
            continue;
        }
        const uvec3 t = triangles[random.below(static_cast<std::uint32_t>(triangles.size()))];
        const vec3 a = finite_vertex(t.x);
        const vec3 b = finite_vertex(t.y);
        const vec3 c = finite_vertex(t.z);
        const double u = random.real(0, 1);
        const double v = random.real(0, 1 - u);
        vec3 p;
        switch (random.below(12)) {
            case 0:
                p = in_box(0.2);
                break;
            case 1:
                p = in_box(2);
                break;
            case 2:
                p = a;
                break;
            case 3:
                p = nudged(b, 3, random);
                break;
            case 4:
                p = nudged(mean(a, b, c, u, 0), 2, random);
                break;
            case 5:
                p = nudged(mean(a, b, c, u, v), 3, random);
                break;
            case 6: {  // Below or above a vertex or an edge, on its half-line.
                p = random.below(2) == 0 ? a : mean(a, b, c, u, 0);
                p.z = in_box(0.1).z;
                break;
            }
            case 7:  // Coordinates of several vertices: on planes of axis-aligned meshes.
                p = {a.x, b.y, c.z};
                break;
            case 8:  // On the plane of a triangle, outside of it.
                p = mean(a, b, c, random.real(-2, 2), random.real(-2, 2));
                break;
            case 9:  // In line with an edge.
                p = mean(a, b, c, random.real(-3, 4), 0);
                break;
            case 10: {  // Under or over a triangle, or in its plane.
                p = mean(a, b, c, u, v);
                const auto axis = static_cast<int>(random.below(3));
                p[axis] = in_box(0.1)[axis];
                break;
            }
            default: {  // Near the surface.
                const vec3 q = in_box(0);
                p = mean(mean(a, b, c, u, v), q, q, random.real(0, 0.01), 0);
                break;
            }
        }
        if (largest_component(p) <= kSceneExtent) points.push_back(p);
    }
    return points;
}

}  // namespace mray::test
