#include <algorithm>
#include <limits>
#include <utility>

#include <glm/common.hpp>

#include "common/image/frame.h"
#include "scenes/procedural/procedural.h"
#include "tests/fuzz/case.h"
#include "tests/support/places.h"
#include "tests/support/shapes.h"

namespace mray::fuzz {
namespace {

using test::dvec3;
using test::Random;
using test::Surroundings;
using Positions = std::vector<dvec3>;

/// Another pose of the same vertices. If a pose keeps a part of the shape, a tree of one pose fits
/// the other in that part.
Positions moved(Random& random, const Positions& from) {
    Positions to = from;
    switch (random.from(0, 8)) {
        case 0:
            break;
        case 1: {  // The vertices jitter.
            const double size = random.magnitude(1e-9, 0.3);
            for (dvec3& p : to) p += random.exact_point(size);
            break;
        }
        case 2:  // Vertices swap their places.
            for (std::size_t i = to.size(); i > 1; --i)
                std::swap(to[i - 1], to[random.below(static_cast<std::uint32_t>(i))]);
            break;
        case 3:  // Each vertex is drawn anew.
            for (dvec3& p : to) p = random.exact_point(1);
            break;
        case 4: {  // The mesh is pressed flat.
            const int axis = random.from(0, 2);
            const double left = random.one_in(2) ? 0 : std::exp2(-random.from(1, 50));
            for (dvec3& p : to) p[axis] *= left;
            break;
        }
        case 5:  // The mesh is mirrored.
            for (dvec3& p : to) p.x = -p.x;
            break;
        case 6:  // One vertex moves.
            random.pick(to) = random.exact_point(1);
            break;
        case 7: {  // The mesh grows or shrinks.
            const double size = random.magnitude(1e-4, 1e4);
            for (dvec3& p : to) p *= size;
            break;
        }
        default: {  // The mesh is shifted.
            const dvec3 by = random.exact_point(2);
            for (dvec3& p : to) p += by;
        }
    }
    return to;
}

/// Maps unit coordinates to world space: scale * (p + offset).
class Placing {
public:
    explicit Placing(Random& random) {
        if (random.one_in(4))
            scale_ = random.one_in(2) ? std::exp2(random.from(-139, 98))
                                      : std::pow(10.0, random.real(-42, 29.5));
        if (!random.one_in(6)) return;
        offset_ = random.one_in(2) ? random.direction() : random.axis();
        offset_ *= random.magnitude(1, 1e8);
    }
    std::vector<vec3> operator()(const Positions& positions) const {
        std::vector<vec3> placed;
        // Files hold at most this; a conversion from beyond the floats would be undefined.
        for (const dvec3& p : positions)
            placed.emplace_back(glm::clamp(scale_ * (p + offset_), -1e30, 1e30));
        return placed;
    }

private:
    double scale_ = 1;
    dvec3 offset_ = {0, 0, 0};
};

/// A few coordinates that are special by their bits, or very far away.
void break_some(Random& random, FuzzCase& fuzz_case) {
    using Limits = std::numeric_limits<float>;
    const bool broken = random.one_in(30);
    if (!broken && !random.one_in(20)) return;
    const float bad[] = {NAN, INFINITY, -INFINITY, -0.0f, Limits::max(), -9.96921e36f, 1e20f};
    const float small[] = {-0.0f, 0.0f, Limits::denorm_min(), -3 * Limits::denorm_min()};
    for (auto& pose : fuzz_case.poses) {
        for (int n = random.from(0, 3); n > 0 && !pose.empty(); --n) {
            random.pick(pose)[random.from(0, 2)] = broken ? random.pick(bad) : random.pick(small);
        }
    }
}

void choose_frames(Random& random, FuzzCase& fuzz_case) {
    const int last = static_cast<int>(fuzz_case.poses.size()) - 1;
    fuzz_case.frame = random.from(0, last);
    if (last > 0 && random.one_in(4)) fuzz_case.frame = random.real(0, last);
    if (random.one_in(2)) fuzz_case.build_at = static_cast<std::size_t>(random.from(0, last));
}

void make_shape_animation(Random& random, FuzzCase& fuzz_case) {
    const test::Shape shape = test::shapes::any(random);
    fuzz_case.triangles = shape.triangles;
    const Placing placed(random);
    Positions pose = shape.positions;
    fuzz_case.poses.push_back(placed(pose));
    for (int n = random.one_in(2) ? 0 : random.from(1, 3); n > 0; --n) {
        pose = moved(random, random.one_in(2) ? pose : shape.positions);
        fuzz_case.poses.push_back(placed(pose));
    }
    break_some(random, fuzz_case);
}

/// A few whole frames of a built-in scene of the least size.
void make_procedural_animation(Random& random, FuzzCase& fuzz_case) {
    const std::string name = random.pick(procedural_scenes()).name;
    const std::unique_ptr<Animation> animation =
        make_procedural(name, static_cast<std::uint64_t>(random.from(1, 400)));
    fuzz_case.triangles = animation->topology().triangles;
    for (int n = random.from(1, 3); n > 0; --n) {
        std::vector<vec3> pose(animation->topology().vertex_count);
        animation->positions(random.from(0, static_cast<int>(animation->last_frame())), pose);
        fuzz_case.poses.push_back(std::move(pose));
    }
}

void make_animation(Random& random, FuzzCase& fuzz_case) {
    if (random.one_in(25)) {
        make_procedural_animation(random, fuzz_case);
    } else {
        make_shape_animation(random, fuzz_case);
    }
    choose_frames(random, fuzz_case);
}

dvec3 unit(const dvec3& v) {
    const double largest = std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
    if (!(largest > 0)) return {0, 0, -1};
    const dvec3 scaled = v / largest;
    return scaled / glm::length(scaled);
}

struct Size {
    std::uint32_t width, height;
};
constexpr Size kSizes[] = {
    {1, 1},   {5, 5},  {4, 4},  {17, 5},  {8, 8},   {16, 16}, {16, 16}, {9, 21},  {33, 31},
    {32, 32}, {64, 1}, {1, 64}, {3, 257}, {257, 3}, {64, 64}, {65, 63}, {31, 33},
};

void choose_size(Random& random, const Surroundings& around, double tests, ViewSpec& view) {
    const double rays = 1.0 + rays_per_hit(view.rays, view.ao_count);
    const double triangles = std::max<double>(1, static_cast<double>(around.triangles.size()));
    for (int tries = 0; tries < 20; ++tries) {
        const Size size = random.pick(kSizes);
        view.width = size.width;
        view.height = size.height;
        if (triangles * rays * size.width * size.height <= tests) return;
    }
    view.width = view.height = 4;
}

double field_of_view(Random& random) {
    if (random.one_in(6)) return random.magnitude(1e-18, 1);
    if (random.one_in(6)) return 180 - random.magnitude(1e-10, 10);
    return random.real(5, 170);
}

/// The target of the camera.
dvec3 choose_target(Random& random, const Surroundings& around, const dvec3& eye) {
    const int kind = random.from(0, 6);
    if (kind == 0) return eye + random.axis() * around.extent;
    if (kind > 2) return special_target(random, around);
    const double distance = kind == 1 ? 1 : random.magnitude(1e-8, 1);
    return eye + random.direction() * (around.extent * distance);
}

dvec3 choose_up(Random& random, const dvec3& forward) {
    const int kind = random.from(0, 6);
    if (kind == 1) return random.axis();
    if (kind > 3) return {0, 1, 0};
    const dvec3 direction = random.direction();
    if (kind > 1) return direction;
    const double sign = random.sign();
    return forward * sign + direction * random.magnitude(1e-8, 1e-2);
}

ViewSpec make_view(Random& random, const Surroundings& around, double tests) {
    ViewSpec view;
    constexpr std::uint32_t kKinds[] = {kRaysPrimary, kRaysShadow, kRaysShadow, kRaysAo};
    view.rays = random.pick(kKinds);
    view.ao_count = static_cast<std::uint32_t>(random.from(1, 5));
    if (random.one_in(2)) view.ao_distance = around.extent * random.magnitude(1e-5, 10);
    if (random.one_in(20)) view.ao_distance = around.extent * random.magnitude(1, 1e9);
    choose_size(random, around, tests, view);
    const dvec3 eye = special_place(random, around);
    const dvec3 target = choose_target(random, around, eye);
    const dvec3 up = choose_up(random, unit(target - eye));
    view.eye = to_point(eye);
    view.target = to_point(target);
    view.up = to_point(up);
    view.fov = field_of_view(random);
    dvec3 light = special_place(random, around);
    if (random.one_in(5)) light = eye;
    if (random.one_in(12)) {
        const int k = random.from(0, 60);
        light = eye + random.direction() * (around.extent * std::exp2(-k));
    }
    view.light = to_point(light);
    return view;
}

}  // namespace

FuzzCase make_case(std::uint64_t seed) {
    // Ray-triangle tests that brute force may take for an image.
    constexpr double kTests = 4e5;
    Random random(seed);
    FuzzCase fuzz_case;
    make_animation(random, fuzz_case);
    const Surroundings around(seen_positions(fuzz_case, fuzz_case.frame), fuzz_case.triangles);
    fuzz_case.view = make_view(random, around, kTests);
    while (fuzz_case.rays.size() < 48) fuzz_case.rays.push_back(special_ray(random, around));
    return fuzz_case;
}

FuzzCase make_questions(std::uint64_t seed) {
    Random random(seed);
    FuzzCase fuzz_case;
    make_animation(random, fuzz_case);
    const Surroundings around(seen_positions(fuzz_case, fuzz_case.frame), fuzz_case.triangles);
    fuzz_case.view.width = fuzz_case.view.height = 0;
    fuzz_case.asks_questions = true;
    if (random.one_in(4)) fuzz_case.rays = test::ray_groups(random, around, 2, 40);
    if (random.one_in(4)) fuzz_case.points = test::point_groups(random, around, 20, 16);
    while (fuzz_case.rays.size() < 24) fuzz_case.rays.push_back(special_ray(random, around));
    while (fuzz_case.points.size() < 64) fuzz_case.points.push_back(special_point(random, around));
    return fuzz_case;
}

std::uint64_t case_seed(std::uint64_t campaign_seed, std::uint64_t index) {
    Random random(campaign_seed + index * 0xD1342543DE82EF95u);
    return random.bits();
}

}  // namespace mray::fuzz
