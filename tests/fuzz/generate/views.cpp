#include "tests/fuzz/generate/generate.h"

#include <algorithm>
#include <limits>

#include "common/image/frame.h"

namespace mray::fuzz {
namespace {

dvec3 unit(const dvec3& v) {
    const double largest = std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
    if (!(largest > 0)) return {0, 0, -1};
    const dvec3 scaled = v / largest;
    return scaled / glm::length(scaled);
}

struct Size {
    std::uint32_t width, height;
};
constexpr std::array kSizes = {
    Size{1, 1},   Size{5, 5},   Size{4, 4},   Size{17, 5},  Size{8, 8},   Size{16, 16},
    Size{16, 16}, Size{9, 21},  Size{33, 31}, Size{32, 32}, Size{64, 1},  Size{1, 64},
    Size{3, 257}, Size{257, 3}, Size{64, 64}, Size{65, 63}, Size{31, 33},
};

void choose_size(Dice& dice, const Surroundings& around, double tests, ViewSpec& view) {
    const double rays = 1.0 + rays_per_hit(view.rays, view.ao_count);
    const double triangles = std::max<double>(1, static_cast<double>(around.triangles.size()));
    for (int tries = 0; tries < 20; ++tries) {
        const Size size = dice.pick(kSizes);
        view.width = size.width;
        view.height = size.height;
        if (triangles * rays * size.width * size.height <= tests) return;
    }
    view.width = view.height = 4;
}

double field_of_view(Dice& dice) {
    if (dice.one_in(6)) return dice.magnitude(1e-18, 1);
    if (dice.one_in(6)) return 180 - dice.magnitude(1e-10, 10);
    return dice.real(5, 170);
}

/// The target of the camera.
dvec3 choose_target(Dice& dice, const Surroundings& around, const dvec3& eye) {
    switch (dice.from(0, 6)) {
        case 0:
            return eye + dice.axis() * around.extent;
        case 1:
            return eye + dice.direction() * around.extent;
        case 2: {
            return eye + dice.direction() * (around.extent * dice.magnitude(1e-8, 1));
        }
        default:
            return special_target(dice, around);
    }
}

dvec3 choose_up(Dice& dice, const dvec3& forward) {
    switch (dice.from(0, 6)) {
        case 0:
            return forward * dice.sign() + dice.direction() * dice.magnitude(1e-8, 1e-2);
        case 1:
            return dice.axis();
        case 2:
        case 3:
            return dice.direction();
        default:
            return {0, 1, 0};
    }
}

/// A ray's direction has any length.
WorldRay ray_towards(Dice& dice, const Surroundings& around, const dvec3& org,
                     const dvec3& target) {
    dvec3 dir = target - org;
    if (dice.one_in(8)) dir = dice.axis();
    if (dice.one_in(8)) dir = dice.direction() * around.extent;
    WorldRay ray = {};
    ray.org = org;
    ray.dir = dir;
    ray.tnear = dice.one_in(6) ? dice.real(0, 1) : 0;
    ray.tfar = dice.one_in(6) ? dice.real(0.5, 2) : std::numeric_limits<double>::infinity();
    // The target is at 1.
    if (dice.one_in(8)) ray.tnear = 1;
    if (dice.one_in(8)) ray.tfar = 1;
    return ray;
}

}  // namespace

ViewSpec make_view(Dice& dice, const Surroundings& around, double tests) {
    ViewSpec view;
    constexpr std::array kKinds = {kRaysPrimary, kRaysShadow, kRaysShadow, kRaysAo};
    view.rays = dice.pick(kKinds);
    view.ao_count = static_cast<std::uint32_t>(dice.from(1, 5));
    if (dice.one_in(2)) view.ao_distance = around.extent * dice.magnitude(1e-5, 10);
    if (dice.one_in(20)) view.ao_distance = around.extent * dice.magnitude(1, 1e9);
    choose_size(dice, around, tests, view);
    const dvec3 eye = special_place(dice, around);
    const dvec3 target = choose_target(dice, around, eye);
    const dvec3 up = choose_up(dice, unit(target - eye));
    view.eye = to_point(eye);
    view.target = to_point(target);
    view.up = to_point(up);
    view.fov = field_of_view(dice);
    dvec3 light = special_place(dice, around);
    if (dice.one_in(5)) light = eye;
    if (dice.one_in(12)) {
        const int k = dice.from(0, 60);
        light = eye + dice.direction() * (around.extent * std::exp2(-k));
    }
    view.light = to_point(light);
    return view;
}

std::vector<WorldRay> make_rays(Dice& dice, const Surroundings& around, std::size_t count) {
    std::vector<WorldRay> rays;
    while (rays.size() < count) {
        const dvec3 org = special_place(dice, around);
        const dvec3 target = special_target(dice, around);
        rays.push_back(ray_towards(dice, around, org, target));
    }
    return rays;
}

std::vector<WorldRay> make_ray_groups(Dice& dice, const Surroundings& around, std::size_t groups,
                                      std::size_t size) {
    std::vector<WorldRay> rays;
    for (std::size_t group = 0; group < groups; ++group) {
        const dvec3 org = special_place(dice, around);
        const dvec3 target = special_target(dice, around);
        const double spread = dice.magnitude(1e-9, 1) * around.extent;
        for (std::size_t i = 0; i < size; ++i)
            rays.push_back(ray_towards(dice, around, org, target + dice.point(spread)));
    }
    return rays;
}

}  // namespace mray::fuzz
