#include "tests/fuzz/generate/generate.h"

#include <algorithm>
#include <limits>

#include <glm/common.hpp>

namespace mray::fuzz {
namespace {

bool finite(const vec3& p) {
    return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
}

/// A weight of a vertex: every other one such that sums stay exact on a grid.
double weight(Dice& dice, double lower, double upper) {
    const double w = dice.real(lower, upper);
    return dice.one_in(2) ? std::round(w * 8) / 8 : w;
}

dvec3 combined(const Surroundings::Corners& t, double u, double v) {
    return t.a + (t.b - t.a) * u + (t.c - t.a) * v;
}

dvec3 normal_of(Dice& dice, const Surroundings::Corners& t) {
    // First scaled by the longest side, so that no square overflows or vanishes.
    const dvec3 ab = t.b - t.a;
    const dvec3 ac = t.c - t.a;
    double largest = 0;
    for (int axis = 0; axis < 3; ++axis)
        largest = std::max({largest, std::abs(ab[axis]), std::abs(ac[axis])});
    if (!(largest > 0)) return dice.direction();
    const dvec3 normal = glm::cross(ab / largest, ac / largest);
    const double length = glm::length(normal);
    return length > 0 ? normal / length : dice.direction();
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

dvec3 place_in_plane(Dice& dice, const Surroundings::Corners& t) {
    switch (dice.from(0, 5)) {
        case 0:
            return dice.one_in(2) ? t.a : t.b;
        case 1:
            return combined(t, weight(dice, 0, 1), 0);
        case 2: {
            const double u = weight(dice, 0, 1);
            return combined(t, u, weight(dice, 0, 1 - u));
        }
        case 3:
            return combined(t, weight(dice, -30, 30), 0);
        case 4: {
            const double u = weight(dice, -3, 3);
            return combined(t, u, weight(dice, -3, 3));
        }
        default: {
            const double far = dice.magnitude(3, 1e4);
            const double u = weight(dice, -far, far);
            return combined(t, u, weight(dice, -far, far));
        }
    }
}

dvec3 place_off_plane(Dice& dice, const Surroundings& around, const Surroundings::Corners& t,
                      int first, int last) {
    const dvec3 place = place_in_plane(dice, t);
    const int k = dice.from(first, last);
    return place + normal_of(dice, t) * (dice.sign() * around.extent * std::exp2(-k));
}

dvec3 special_place(Dice& dice, const Surroundings& around) {
    const int kind = dice.from(0, 9);
    if (kind <= 6 && !around.triangles.empty()) {
        const auto count = static_cast<std::uint32_t>(around.triangles.size());
        const Surroundings::Corners& t = around.triangles[dice.below(count)];
        return dice.one_in(2) ? place_in_plane(dice, t) : place_off_plane(dice, around, t, 0, 60);
    }
    if (kind == 7) return around.centre + dice.point(around.extent);
    if (kind == 8) return around.centre + dice.direction() * (around.extent * dice.real(1, 6));
    return around.centre + dice.direction() * (around.extent * dice.magnitude(6, 1e6));
}

dvec3 special_target(Dice& dice, const Surroundings& around) {
    const int kind = dice.from(0, 5);
    if (around.triangles.empty() || kind == 0) return around.centre + dice.point(around.extent);
    const auto count = static_cast<std::uint32_t>(around.triangles.size());
    const Surroundings::Corners& t = around.triangles[dice.below(count)];
    if (kind == 1) return t.a;
    if (kind == 2) return combined(t, 0.5, 0);
    if (kind == 3) {
        const double u = weight(dice, -2, 2);
        return combined(t, u, weight(dice, -2, 2));
    }
    const double u = dice.real(0, 1);
    return combined(t, u, dice.real(0, 1 - u));
}

}  // namespace mray::fuzz
