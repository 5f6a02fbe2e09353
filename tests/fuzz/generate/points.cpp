#include "tests/fuzz/generate/generate.h"

#include <cmath>
#include <limits>

namespace mray::fuzz {
namespace {

/// The nearest floats, each moved by up to 3 ulp every other time.
vec3 to_floats(Dice& dice, const dvec3& p) {
    const bool is_nudged = dice.one_in(2);
    vec3 point;
    for (int axis = 0; axis < 3; ++axis) {
        float x = static_cast<float>(p[axis]);
        for (int ulps = is_nudged ? dice.from(0, 3) : 0; ulps > 0; --ulps)
            x = std::nextafter(x, static_cast<float>(dice.sign()) * 1e38f);
        point[axis] = x;
    }
    return point;
}

float odd_coordinate(Dice& dice) {
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
    return dice.pick(kOdd);
}

dvec3 vertex_of(Dice& dice, const Surroundings& around) {
    return around.vertices[dice.below(static_cast<std::uint32_t>(around.vertices.size()))];
}

dvec3 place_of_point(Dice& dice, const Surroundings& around) {
    if (around.vertices.empty()) return dice.point(around.extent);
    switch (dice.from(0, 7)) {
        case 0: {  // Above, below or beside a vertex.
            dvec3 p = vertex_of(dice, around);
            const int axis = dice.one_in(2) ? 2 : dice.from(0, 2);
            p[axis] = around.centre[axis] + dice.real(-2, 2) * around.extent;
            return p;
        }
        case 1: {  // The same for an edge or any other place of a mesh.
            dvec3 p = special_target(dice, around);
            p.z = around.centre.z + dice.real(-2, 2) * around.extent;
            return p;
        }
        case 2: {  // Coordinates of several vertices: on planes of meshes along axes.
            const dvec3 a = vertex_of(dice, around);
            const dvec3 b = vertex_of(dice, around);
            const dvec3 c = vertex_of(dice, around);
            return {a.x, b.y, c.z};
        }
        case 3: {  // As far from one vertex as from another.
            const dvec3 a = vertex_of(dice, around);
            return a * 0.5 + vertex_of(dice, around) * 0.5;
        }
        case 4:
            return special_target(dice, around);
        default:
            return special_place(dice, around);
    }
}

}  // namespace

std::vector<vec3> make_points(Dice& dice, const Surroundings& around, std::size_t count) {
    std::vector<vec3> points;
    while (points.size() < count) {
        const dvec3 place = place_of_point(dice, around);
        vec3 point = to_floats(dice, place);
        if (dice.one_in(12)) point[dice.from(0, 2)] = odd_coordinate(dice);
        if (dice.one_in(24)) point = point * static_cast<float>(dice.magnitude(1e-30, 1e30));
        points.push_back(point);
    }
    return points;
}

std::vector<vec3> make_groups(Dice& dice, const Surroundings& around, std::size_t groups,
                              std::size_t size) {
    std::vector<vec3> points;
    for (const vec3& centre : make_points(dice, around, groups)) {
        const double spread = dice.magnitude(1e-9, 1) * around.extent;
        points.push_back(centre);
        for (std::size_t i = 1; i < size; ++i) {
            const dvec3 offset = dice.point(spread);
            points.push_back(to_floats(dice, dvec3(centre) + offset));
        }
    }
    return points;
}

}  // namespace mray::fuzz
