#include "tests/fuzz/generate/generate.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "scenes/procedural/procedural.h"

namespace mray::fuzz {
namespace {

using Positions = std::vector<dvec3>;

/// Another pose of the same vertices. If a pose keeps a part of the shape, a tree of one pose fits
/// the other in that part.
Positions moved(Dice& dice, const Positions& from) {
    Positions to = from;
    switch (dice.from(0, 8)) {
        case 0:
            break;
        case 1: {  // The vertices jitter.
            const double size = dice.magnitude(1e-9, 0.3);
            for (dvec3& p : to) p += dice.point(size);
            break;
        }
        case 2:  // Vertices swap their places.
            for (std::size_t i = to.size(); i > 1; --i)
                std::swap(to[i - 1], to[dice.below(static_cast<std::uint32_t>(i))]);
            break;
        case 3:  // Each vertex is drawn anew.
            for (dvec3& p : to) p = dice.point(1);
            break;
        case 4: {  // The mesh is pressed flat.
            const int axis = dice.from(0, 2);
            const double left = dice.one_in(2) ? 0 : std::exp2(-dice.from(1, 50));
            for (dvec3& p : to) p[axis] *= left;
            break;
        }
        case 5:  // The mesh is mirrored.
            for (dvec3& p : to) p.x = -p.x;
            break;
        case 6:  // One vertex moves.
            to[dice.below(static_cast<std::uint32_t>(to.size()))] = dice.point(1);
            break;
        case 7: {  // The mesh grows or shrinks.
            const double size = dice.magnitude(1e-4, 1e4);
            for (dvec3& p : to) p *= size;
            break;
        }
        default: {  // The mesh is shifted.
            const dvec3 by = dice.point(2);
            for (dvec3& p : to) p += by;
        }
    }
    return to;
}

/// The map from unit coordinates to world space: scale * p + offset.
struct Placing {
    double scale = 1;
    dvec3 offset = {0, 0, 0};
};

Placing make_placing(Dice& dice) {
    Placing placing;
    if (dice.one_in(4)) {
        placing.scale =
            dice.one_in(2) ? std::exp2(dice.from(-139, 98)) : std::pow(10.0, dice.real(-42, 29.5));
    }
    if (dice.one_in(6)) {
        const double far = dice.magnitude(1, 1e8);
        placing.offset = dice.one_in(2) ? far * dice.direction() : far * dice.axis();
    }
    return placing;
}

std::vector<vec3> placed(const Positions& positions, const Placing& placing) {
    std::vector<vec3> placed;
    placed.reserve(positions.size());
    for (const dvec3& p : positions) {
        vec3 world;
        for (int axis = 0; axis < 3; ++axis) {
            // Files hold at most this; a conversion from beyond the floats would be undefined.
            const double x = placing.scale * (p[axis] + placing.offset[axis]);
            world[axis] = static_cast<float>(std::clamp(x, -1e30, 1e30));
        }
        placed.push_back(world);
    }
    return placed;
}

/// A few coordinates that are special by their bits, or very far away.
void break_some(Dice& dice, FuzzCase& fuzz_case) {
    using Limits = std::numeric_limits<float>;
    const bool broken = dice.one_in(30);
    if (!broken && !dice.one_in(20)) return;
    const std::array bad = {Limits::quiet_NaN(),
                            Limits::infinity(),
                            -Limits::infinity(),
                            -0.0f,
                            Limits::max(),
                            -9.96921e36f,
                            1e20f};
    const std::array small = {-0.0f, 0.0f, Limits::denorm_min(), -3 * Limits::denorm_min()};
    for (auto& pose : fuzz_case.poses) {
        for (int n = dice.from(0, 3); n > 0 && !pose.empty(); --n) {
            vec3& v = pose[dice.below(static_cast<std::uint32_t>(pose.size()))];
            v[dice.from(0, 2)] = broken ? dice.pick(bad) : dice.pick(small);
        }
    }
}

void choose_frames(Dice& dice, FuzzCase& fuzz_case) {
    const int last = static_cast<int>(fuzz_case.poses.size()) - 1;
    fuzz_case.frame = dice.from(0, last);
    if (last > 0 && dice.one_in(4)) fuzz_case.frame = dice.real(0, last);
    if (dice.one_in(2)) fuzz_case.build_at = static_cast<std::size_t>(dice.from(0, last));
}

void make_shape_animation(Dice& dice, FuzzCase& fuzz_case) {
    const Shape shape = make_shape(dice);
    fuzz_case.triangles = shape.triangles;
    const Placing placing = make_placing(dice);
    Positions pose = shape.positions;
    fuzz_case.poses.push_back(placed(pose, placing));
    for (int n = dice.one_in(2) ? 0 : dice.from(1, 3); n > 0; --n) {
        pose = moved(dice, dice.one_in(2) ? pose : shape.positions);
        fuzz_case.poses.push_back(placed(pose, placing));
    }
    break_some(dice, fuzz_case);
}

/// A few whole frames of a built-in scene of the least size.
void make_procedural_animation(Dice& dice, FuzzCase& fuzz_case) {
    const auto scenes = procedural_scenes();
    const ProceduralScene& scene = scenes[dice.below(static_cast<std::uint32_t>(scenes.size()))];
    const std::unique_ptr<Animation> animation =
        make_procedural(scene.name, static_cast<std::uint64_t>(dice.from(1, 400)));
    fuzz_case.triangles = animation->topology().triangles;
    for (int n = dice.from(1, 3); n > 0; --n) {
        std::vector<vec3> pose(animation->topology().vertex_count);
        animation->positions(dice.from(0, static_cast<int>(animation->last_frame())), pose);
        fuzz_case.poses.push_back(std::move(pose));
    }
}

}  // namespace

void make_animation(Dice& dice, FuzzCase& fuzz_case) {
    if (dice.one_in(25)) {
        make_procedural_animation(dice, fuzz_case);
    } else {
        make_shape_animation(dice, fuzz_case);
    }
    choose_frames(dice, fuzz_case);
}

FuzzCase make_case(std::uint64_t seed) {
    // Ray-triangle tests that brute force may take for an image.
    constexpr double kTests = 4e5;
    Dice dice(seed);
    FuzzCase fuzz_case;
    make_animation(dice, fuzz_case);
    const std::vector<vec3> positions = seen_positions(fuzz_case, fuzz_case.frame);
    const Surroundings around(positions, fuzz_case.triangles);
    fuzz_case.view = make_view(dice, around, kTests);
    fuzz_case.rays = make_rays(dice, around, 48);
    return fuzz_case;
}

FuzzCase make_questions(std::uint64_t seed) {
    Dice dice(seed);
    FuzzCase fuzz_case;
    make_animation(dice, fuzz_case);
    const std::vector<vec3> positions = seen_positions(fuzz_case, fuzz_case.frame);
    const Surroundings around(positions, fuzz_case.triangles);
    fuzz_case.view.width = fuzz_case.view.height = 0;
    fuzz_case.rays =
        dice.one_in(4) ? make_ray_groups(dice, around, 2, 40) : make_rays(dice, around, 24);
    fuzz_case.asks_questions = true;
    fuzz_case.points =
        dice.one_in(4) ? make_groups(dice, around, 20, 16) : make_points(dice, around, 64);
    return fuzz_case;
}

std::uint64_t case_seed(std::uint64_t campaign_seed, std::uint64_t index) {
    test::Random random(campaign_seed + index * 0xD1342543DE82EF95u);
    return random.bits();
}

}  // namespace mray::fuzz
