#include "tests/support/places.h"

#include <algorithm>
#include <limits>

#include <glm/common.hpp>

namespace mray::test {
namespace {

bool finite(const vec3& p) {
    return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
}

/// A weight of a vertex: every other one such that sums stay exact on a grid.
double weight(Random& random, double lower, double upper) {
    const double w = random.real(lower, upper);
    return random.one_in(2) ? std::round(w * 8) / 8 : w;
}

dvec3 combined(const Surroundings::Corners& t, double u, double v) {
    return t.a + (t.b - t.a) * u + (t.c - t.a) * v;
}

dvec3 normal_of(Random& random, const Surroundings::Corners& t) {
    // First scaled by the longest side, so that no square overflows or vanishes.
    const dvec3 ab = t.b - t.a;
    const dvec3 ac = t.c - t.a;
    double largest = 0;
    for (int axis = 0; axis < 3; ++axis)
        largest = std::max({largest, std::abs(ab[axis]), std::abs(ac[axis])});
    if (!(largest > 0)) return random.direction();
    const dvec3 normal = glm::cross(ab / largest, ac / largest);
    const double length = glm::length(normal);
    return length > 0 ? normal / length : random.direction();
}

dvec3 place_in_plane(Random& random, const Surroundings::Corners& t) {
    switch (random.from(0, 5)) {
        case 0:
            return random.one_in(2) ? t.a : t.b;
        case 1:
            return combined(t, weight(random, 0, 1), 0);
        case 2: {
            const double u = weight(random, 0, 1);
            return combined(t, u, weight(random, 0, 1 - u));
        }
        case 3:
            return combined(t, weight(random, -30, 30), 0);
        case 4: {
            const double u = weight(random, -3, 3);
            return combined(t, u, weight(random, -3, 3));
        }
        default: {
            const double far = random.magnitude(3, 1e4);
            const double u = weight(random, -far, far);
            return combined(t, u, weight(random, -far, far));
        }
    }
}

/// The nearest floats, each moved by up to 3 ulp every other time.
vec3 to_floats(Random& random, const dvec3& p) {
    const bool is_nudged = random.one_in(2);
    vec3 point;
    for (int axis = 0; axis < 3; ++axis) {
        float x = static_cast<float>(p[axis]);
        for (int ulps = is_nudged ? random.from(0, 3) : 0; ulps > 0; --ulps)
            x = std::nextafter(x, static_cast<float>(random.sign()) * 1e38f);
        point[axis] = x;
    }
    return point;
}

float odd_coordinate(Random& random) {
    using Limits = std::numeric_limits<float>;
    constexpr std::array kOdd = {0.0f,
                                 -0.0f,
                                 Limits::denorm_min(),
                                 -1e-40f,
                                 Limits::min(),
                                 Limits::max(),
                                 -Limits::max(),
                                 Limits::infinity(),
                                 Limits::quiet_NaN()};
    return random.pick(kOdd);
}

dvec3 place_of_point(Random& random, const Surroundings& around) {
    if (around.vertices.empty()) return random.exact_point(around.extent);
    switch (random.from(0, 7)) {
        case 0: {  // Above, below or beside a vertex.
            dvec3 p = random.pick(around.vertices);
            const int axis = random.one_in(2) ? 2 : random.from(0, 2);
            p[axis] = around.centre[axis] + random.real(-2, 2) * around.extent;
            return p;
        }
        case 1: {  // The same for an edge or any other place of a mesh.
            dvec3 p = special_target(random, around);
            p.z = around.centre.z + random.real(-2, 2) * around.extent;
            return p;
        }
        case 2: {  // Coordinates of several vertices: on planes of meshes along axes.
            const dvec3 a = random.pick(around.vertices);
            const dvec3 b = random.pick(around.vertices);
            const dvec3 c = random.pick(around.vertices);
            return {a.x, b.y, c.z};
        }
        case 3: {  // As far from one vertex as from another.
            const dvec3 a = random.pick(around.vertices);
            return a * 0.5 + random.pick(around.vertices) * 0.5;
        }
        case 4:
            return special_target(random, around);
        default:
            return special_place(random, around);
    }
}

/// A ray's direction has any length.
WorldRay ray_towards(Random& random, const Surroundings& around, const dvec3& org,
                     const dvec3& target) {
    dvec3 dir = target - org;
    if (random.one_in(8)) dir = random.axis();
    if (random.one_in(8)) dir = random.direction() * around.extent;
    WorldRay ray = {};
    ray.org = org;
    ray.dir = dir;
    ray.tnear = random.one_in(6) ? random.real(0, 1) : 0;
    ray.tfar = random.one_in(6) ? random.real(0.5, 2) : std::numeric_limits<double>::infinity();
    // The target is at 1.
    if (random.one_in(8)) ray.tnear = 1;
    if (random.one_in(8)) ray.tfar = 1;
    return ray;
}

}  // namespace

Surroundings::Surroundings(std::span<const vec3> positions, std::span<const uvec3> indices) {
    const double inf = std::numeric_limits<double>::infinity();
    dvec3 lower(inf, inf, inf);
    dvec3 upper = -lower;
    for (const vec3& p : positions) {
        if (!finite(p)) continue;
        vertices.emplace_back(p);
        lower = glm::min(lower, dvec3(p));
        upper = glm::max(upper, dvec3(p));
    }
    for (const uvec3& t : indices) {
        if (finite(positions[t.x]) && finite(positions[t.y]) && finite(positions[t.z]))
            triangles.push_back({positions[t.x], positions[t.y], positions[t.z]});
    }
    if (vertices.empty()) return;
    centre = lower / 2.0 + upper / 2.0;
    const dvec3 half = upper / 2.0 - lower / 2.0;
    extent = std::max({half.x, half.y, half.z});
    if (extent == 0)
        extent = std::max({std::abs(centre.x), std::abs(centre.y), std::abs(centre.z)});
    if (extent == 0) extent = 1;
}

dvec3 special_place(Random& random, const Surroundings& around) {
    const int kind = random.from(0, 9);
    if (kind <= 6 && !around.triangles.empty()) {
        const Surroundings::Corners& t = random.pick(around.triangles);
        const dvec3 place = place_in_plane(random, t);
        if (random.one_in(2)) return place;
        const dvec3 off = normal_of(random, t) * (random.sign() * around.extent);
        return place + off * std::exp2(-random.from(0, 60));
    }
    if (kind == 7) return around.centre + random.exact_point(around.extent);
    if (kind == 8) return around.centre + random.direction() * (around.extent * random.real(1, 6));
    return around.centre + random.direction() * (around.extent * random.magnitude(6, 1e6));
}

dvec3 special_target(Random& random, const Surroundings& around) {
    const int kind = random.from(0, 5);
    if (around.triangles.empty() || kind == 0)
        return around.centre + random.exact_point(around.extent);
    const Surroundings::Corners& t = random.pick(around.triangles);
    if (kind == 1) return t.a;
    if (kind == 2) return combined(t, 0.5, 0);
    if (kind == 3) {
        const double u = weight(random, -2, 2);
        return combined(t, u, weight(random, -2, 2));
    }
    const double u = random.real(0, 1);
    return combined(t, u, random.real(0, 1 - u));
}

WorldRay special_ray(Random& random, const Surroundings& around) {
    const dvec3 org = special_place(random, around);
    return ray_towards(random, around, org, special_target(random, around));
}

std::vector<WorldRay> ray_groups(Random& random, const Surroundings& around, std::size_t groups,
                                 std::size_t size) {
    std::vector<WorldRay> rays;
    for (std::size_t group = 0; group < groups; ++group) {
        const dvec3 org = special_place(random, around);
        const dvec3 target = special_target(random, around);
        const double spread = random.magnitude(1e-9, 1) * around.extent;
        for (std::size_t i = 0; i < size; ++i)
            rays.push_back(ray_towards(random, around, org, target + random.exact_point(spread)));
    }
    return rays;
}

vec3 special_point(Random& random, const Surroundings& around) {
    vec3 point = to_floats(random, place_of_point(random, around));
    if (random.one_in(12)) point[random.from(0, 2)] = odd_coordinate(random);
    if (random.one_in(24)) point *= static_cast<float>(random.magnitude(1e-30, 1e30));
    return point;
}

std::vector<vec3> point_groups(Random& random, const Surroundings& around, std::size_t groups,
                               std::size_t size) {
    std::vector<vec3> points;
    for (std::size_t group = 0; group < groups; ++group) {
        const vec3 centre = special_point(random, around);
        const double spread = random.magnitude(1e-9, 1) * around.extent;
        points.push_back(centre);
        for (std::size_t i = 1; i < size; ++i) {
            const dvec3 offset = random.exact_point(spread);
            points.push_back(to_floats(random, dvec3(centre) + offset));
        }
    }
    return points;
}

}  // namespace mray::test
