// Scene space against long double, which holds every sum and product here exactly.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "common/scene/scene_space.h"
#include "tests/support/test_scene.h"
#include "tests/support/thrown_error.h"

namespace mray {
namespace {

using Real = long double;
using test::Random;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

float between(Random& random, double lower, double upper) {
    const auto x = static_cast<float>(random.real(lower, upper));
    return std::min(std::max(x, static_cast<float>(lower)), static_cast<float>(upper));
}

// Points in boxes of many sizes, shapes and places.
std::vector<std::vector<vec3>> scenes() {
    Random random(1);
    std::vector<std::vector<vec3>> all;
    const double boxes[][2] = {
        {-1, 1},           {0, 1},          {1, 2},           {1e7, 1e7 + 3},
        {-1e7, -9.9e6},    {-1e-39, 1e-39}, {0, 1e-44},       {1e-42, 3e-42},
        {-3e38, 3e38},     {1e38, 3.4e38},  {-7e5, 1},        {0.3, 0.9},
        {0.3, 0.8},        {1, 2.9},        {1, 2.9001},      {16777216, 16777218},
        {-1.0001, 0.9999}, {5e29, 5.1e29},  {-1e-20, -9e-21}, {1e-45, 1e38}};
    for (const auto& x : boxes) {
        for (const auto& y : boxes) {
            std::vector<vec3>& points = all.emplace_back();
            for (int i = 0; i < 30; ++i) {
                points.push_back({between(random, x[0], x[1]), between(random, y[0], y[1]),
                                  between(random, 0.25 * x[0], 0.25 * x[1])});
            }
        }
    }
    return all;
}

TEST(SceneSpace, PutsEveryPointOfTheBoundsIntoTheExtentAndUsesMoreThanHalfOfIt) {
    for (const auto& points : scenes()) {
        const SceneSpace space(bounds_of(points));
        float largest = 0;
        for (const vec3& p : points) {
            const vec3 s = space.to_scene(p);
            for (int axis = 0; axis < 3; ++axis) largest = std::max(largest, std::fabs(s[axis]));
        }
        EXPECT_LE(largest, kSceneExtent);
        EXPECT_GT(largest, kSceneExtent * 0.49f);
    }
}

TEST(SceneSpace, KeepsDifferencesExactlyUpToThePowerOfTwo) {
    for (const auto& points : scenes()) {
        const SceneSpace space(bounds_of(points));
        for (std::size_t i = 1; i < points.size(); ++i) {
            for (int axis = 0; axis < 3; ++axis) {
                const Real a = points[i][axis];
                const Real b = points[i - 1][axis];
                const Real expected = std::ldexp(a - b, space.exponent());
                const Real actual = Real(space.to_scene(points[i])[axis]) -
                                    Real(space.to_scene(points[i - 1])[axis]);
                // Only what is below the grid is rounded, to a multiple of 2^-39.
                EXPECT_NEAR(double(actual), double(expected), 0x1p-39);
            }
        }
    }
}

TEST(SceneSpace, IsInvertedExactly) {
    for (const auto& points : scenes()) {
        const WorldBounds bounds = bounds_of(points);
        const SceneSpace space(bounds);
        for (const vec3& p : points) {
            const vec3 back = space.to_world(space.to_scene(p));
            for (int axis = 0; axis < 3; ++axis) {
                // 2^-36 of the extent is the least that the contract covers.
                const Real size = std::ldexp(std::fabs(Real(p[axis])), space.exponent());
                if (size < 0x1p-16L) continue;
                EXPECT_EQ(back[axis], p[axis]) << bounds.lower[axis] << ' ' << bounds.upper[axis];
            }
        }
    }
}

TEST(SceneSpace, PutsCoordinatesOnTheGridAndHasNoNegativeZero) {
    Random random(1);
    const SceneSpace space(WorldBounds{{-1, -1, -1}, {1, 1, 1}});
    std::vector<float> values = {0.0f, -0.0f, 1e-45f, -1e-45f, -1e-30f, 0x1p-61f, -0x1p-60f};
    for (int i = 0; i < 100000; ++i) {
        values.push_back(static_cast<float>(
            std::ldexp(2 * random.real(0, 1) - 1, -static_cast<int>(random.bits() % 90))));
    }
    for (const float x : values) {
        const float s = space.to_scene({x, 1, 1}).x;
        const Real steps = std::ldexp(Real(s), 40);
        EXPECT_EQ(steps, std::nearbyint(steps));
        EXPECT_FALSE(s == 0 && std::signbit(s));
        EXPECT_LE(std::fabs(Real(s) - std::ldexp(Real(x), 20)), 0x1p-40L);
    }
}

TEST(SceneSpace, MarksVerticesThatAreNotFiniteOnAllAxes) {
    const SceneSpace space(WorldBounds{{5, 5, 5}, {6, 6, 6}});
    const vec3 invalid(kInvalidCoordinate, kInvalidCoordinate, kInvalidCoordinate);
    for (const float bad : {kNan, kInfinity, -kInfinity}) {
        EXPECT_EQ(space.to_scene({bad, 5, 5}), invalid);
        EXPECT_EQ(space.to_scene({5, bad, 5}), invalid);
        EXPECT_EQ(space.to_scene({5, 5, bad}), invalid);
    }
}

TEST(SceneSpace, IsTheIdentityForEmptyBounds) {
    const SceneSpace space{WorldBounds{}};
    EXPECT_EQ(space.exponent(), 0);
    EXPECT_EQ(space.to_scene({1, -2, 3.5}), vec3(1, -2, 3.5));
}

TEST(SceneSpace, PutsAPointAtItsOwnSizeOrAtZero) {
    const SceneSpace zero(WorldBounds{{0, 0, 0}, {0, 0, 0}});
    EXPECT_EQ(zero.to_scene({0, 0, 0}), vec3(0, 0, 0));
    const SceneSpace point(WorldBounds{{3, 3, 3}, {3, 3, 3}});
    EXPECT_EQ(point.to_scene({3, 3, 3}), vec3(0, 0, 0));
    EXPECT_EQ(point.to_world({0, 0, 0}), vec3(3, 3, 3));
    EXPECT_EQ(point.length_to_scene(4), 0x1p20);
}

TEST(WorldBounds, AreThoseOfTheFinitePoints) {
    EXPECT_TRUE(bounds_of({}).empty());
    EXPECT_TRUE(bounds_of(std::vector<vec3>{{kNan, 0, 0}, {0, -kInfinity, 0}}).empty());
    const std::vector<vec3> points = {
        {3, 0, -3e38f}, {9, kNan, 9}, {-1, 2, 3e38f}, {kInfinity, 0, 0}, {0, 1, 0}};
    const WorldBounds bounds = bounds_of(points);
    const vec3 lower = {-1, 0, -3e38f};
    const vec3 upper = {3, 2, 3e38f};
    for (int axis = 0; axis < 3; ++axis) {
        EXPECT_EQ(bounds.lower[axis], lower[axis]);
        EXPECT_EQ(bounds.upper[axis], upper[axis]);
    }
}

PoseExtent extent_of(std::initializer_list<vec3> points) {
    PoseExtent pose;
    pose.add(std::vector<vec3>(points));
    return pose;
}

TEST(SpaceOfPose, IsThatOfTheReferenceUntilAPoseLeavesItsRange) {
    const WorldBounds reference{{-1, -1, -1}, {3, 1, 1}};
    const SceneSpace expected(reference);
    for (const PoseExtent& pose : {PoseExtent(), extent_of({{-4, 0, -4}, {4, 4, 0}})})
        EXPECT_EQ(space_of_pose(reference, pose), expected);
    const SceneSpace extended = space_of_pose(reference, extent_of({{5, 0, 0}, {9, 1, 1}}));
    EXPECT_EQ(extended, SceneSpace(WorldBounds{{-1, -1, -1}, {9, 1, 1}}));
    EXPECT_LE(extended.to_scene({9, 1, 1}).x, kSceneExtent);
}

TEST(SpaceOfPose, LeavesOutVerticesBeyond2To37TimesTheBulk) {
    const vec3 invalid(kInvalidCoordinate);
    // Three of five vertices have a coordinate of at most 2, and more than 1.
    const auto pose_with = [](float far) {
        return extent_of({{1.5f, 0, 0}, {0, -2, 0}, {0, 0, 1.25f}, {3, 3, 3}, {0, far, 0}});
    };
    EXPECT_EQ(space_of_pose({}, pose_with(0x1p38f)).to_scene({0, 0x1p38f, 0}).y, kSceneExtent);
    const float beyond = std::nextafter(0x1p38f, 0x1p39f);
    const SceneSpace space = space_of_pose({}, pose_with(beyond));
    EXPECT_EQ(space.to_scene({0, beyond, 0}), invalid);
    EXPECT_EQ(space.exponent(),
              SceneSpace(bounds_of(std::vector<vec3>{{3, 3, 3}, {0, -2, 0}})).exponent());
    // Bounds keep what is in them.
    const WorldBounds wide{{0, 0, 0}, {1, 0x1p60, 1}};
    EXPECT_EQ(space_of_pose(wide, pose_with(beyond)), SceneSpace(wide));
}

TEST(SpaceOfPose, OfCollapsedAndDistantVerticesLeavesOutNone) {
    // Vertices at 0 say nothing about the size of a scene.
    for (const PoseExtent& pose :
         {extent_of({{0, 0, 0}, {0, 0, 0}, {-0.0f, -0.0f, -0.0f}, {1, 1, 1}}),
          extent_of({{0, 0, 0}}), extent_of({{1e20f, 0, 0}, {1e20f, 1, 0}, {1, 1, 1}}),
          extent_of({{0, 3e38f, 0}})})
        EXPECT_EQ(pose.limit(), std::numeric_limits<float>::max());
}

TEST(SceneSpace, ConvertsLengthsExactly) {
    for (const auto& points : scenes()) {
        const SceneSpace space(bounds_of(points));
        for (const double length : {0.0, 1.0, 0.1, 3e10}) {
            EXPECT_EQ(Real(space.length_to_scene(length)),
                      std::ldexp(Real(length), space.exponent()));
            EXPECT_EQ(space.length_to_world(space.length_to_scene(length)), length);
        }
    }
}

TEST(SceneSpace, TakesPointsUpToAMillionExtentsAwayAndRefusesOthersByName) {
    const SceneSpace space(WorldBounds{{-1, -1, -1}, {1, 1, 1}});
    const glm::dvec3 far = {0x1p20, -0x1p20, 0.1};
    EXPECT_EQ(space.point_to_scene(far, "it"), vec3(0x1p40f, -0x1p40f, float(0.1 * 0x1p20)));
    const double bad[] = {0x1.000001p20, -1e30, 1e308, kNan, kInfinity};
    for (const double x : bad) {
        const auto error = test::error_of([&] { space.point_to_scene({0, x, 0}, "the lamp"); });
        ASSERT_TRUE(error) << x;
        EXPECT_EQ(error->kind(), ErrorKind::kBadInput);
        EXPECT_TRUE(std::string(error->what()).starts_with("the lamp"));
    }
}

// The point of a ray at a t in world space, in scene space, computed from the world ray and from
// the scene ray.
void expect_same_points(const SceneSpace& space, const WorldRay& world, double t) {
    const SceneRay scene = to_scene(space, world);
    ASSERT_TRUE(scene.valid);
    const vec3 origin = space.to_scene({0, 0, 0});
    const Real scene_t = std::ldexp(Real(t), -scene.t_exponent);
    for (int axis = 0; axis < 3; ++axis) {
        const Real at = Real(world.org[axis]) + Real(t) * world.dir[axis];
        const Real expected = std::ldexp(at, space.exponent()) + origin[axis];
        const Real actual = scene.ray.org[axis] + scene_t * scene.ray.dir[axis];
        const Real size = std::fabs(Real(scene.ray.org[axis])) + scene_t * 2;
        EXPECT_LE(std::fabs(actual - expected), size * 0x1p-22L + 0x1p-39L);
    }
}

TEST(ToSceneRay, KeepsThePointsOfRaysOfAnyScale) {
    Random random(1);
    for (const double scale : {1e-39, 1e-20, 1e-3, 1.0, 7e6, 1e20, 1e38}) {
        const SceneSpace space(WorldBounds{{-scale, -scale, -scale}, {scale, scale, scale}});
        for (const double speed : {1e-300, 1e-50, 1.0, 1e9, 1e60, 1e300}) {
            WorldRay ray{};
            for (int axis = 0; axis < 3; ++axis) {
                ray.org[axis] = scale * (8 * random.real(0, 1) - 4);
                ray.dir[axis] = speed * (2 * random.real(0, 1) - 1);
            }
            ray.tnear = 0;
            ray.tfar = std::numeric_limits<double>::infinity();
            const double t = scale / speed;
            if (t == 0 || !std::isfinite(t)) continue;
            expect_same_points(space, ray, t);
            expect_same_points(space, ray, 1e-6 * t);
        }
    }
}

TEST(ToSceneRay, KeepsTheLargestComponentBelowTwoWhenItsRoundingWouldReachIt) {
    const SceneSpace space(WorldBounds{{-1, -1, -1}, {1, 1, 1}});  // 2^20
    const double almost[] = {std::nextafter(2.0, 0.0), 2 - 0x1p-25, 2 - 0x1p-26};
    for (const double x : almost) {
        const SceneRay scene = to_scene(space, {{0, 0, 0}, {0.5, x, 0}, 0, 1});
        EXPECT_TRUE(scene.valid);
        EXPECT_EQ(scene.ray.dir, vec3(0.25f, 1.0f, 0.0f));
        EXPECT_EQ(scene.t_exponent, -21);
        EXPECT_EQ(scene.ray.tfar, 0x1p21f);
    }
    const double below = 2 - 0x1.8p-24;
    EXPECT_EQ(to_scene(space, {{0, 0, 0}, {0, below, 0}, 0, 1}).ray.dir.y, 0x1.fffffep0f);
}

TEST(ToSceneRay, ScalesTheIntervalAndClampsItToWhatARayCanHold) {
    const SceneSpace space(WorldBounds{{-1, -1, -1}, {1, 1, 1}});  // 2^20
    WorldRay world{{0, 0, 0}, {0, 0, 8}, 0.5, 4};                  // 2^3
    SceneRay scene = to_scene(space, world);
    EXPECT_TRUE(scene.valid);
    EXPECT_EQ(scene.t_exponent, -23);
    EXPECT_EQ(scene.ray.tnear, 0x1p22f);
    EXPECT_EQ(scene.ray.tfar, 0x1p25f);
    world.tnear = -5;
    world.tfar = std::numeric_limits<double>::infinity();
    scene = to_scene(space, world);
    EXPECT_TRUE(scene.valid);
    EXPECT_EQ(scene.ray.tnear, 0);
    EXPECT_EQ(scene.ray.tfar, kInfiniteT);
    world.tnear = -world.tfar;
    EXPECT_EQ(to_scene(space, world).ray.tnear, 0);
}

TEST(ToSceneRay, FindsRaysThatCannotHitInvalid) {
    const SceneSpace space(WorldBounds{{-1, -1, -1}, {1, 1, 1}});
    const WorldRay good{{0, 0, 5}, {0, 0, -1}, 0, 100};
    ASSERT_TRUE(to_scene(space, good).valid);
    for (const double bad : {double(kNan), double(kInfinity), -double(kInfinity)}) {
        for (int axis = 0; axis < 3; ++axis) {
            WorldRay ray = good;
            ray.org[axis] = bad;
            EXPECT_FALSE(to_scene(space, ray).valid);
            ray = good;
            ray.dir[axis] = bad;
            EXPECT_FALSE(to_scene(space, ray).valid);
        }
    }
    WorldRay ray = good;
    ray.dir[2] = 0;
    EXPECT_FALSE(to_scene(space, ray).valid);
    ray = good;
    ray.org[0] = 0x1.01p20;
    EXPECT_FALSE(to_scene(space, ray).valid);
    for (const auto& [tnear, tfar] : {std::pair{2.0, 1.0},
                                      {0.0, -1.0},
                                      {double(kNan), 1.0},
                                      {0.0, double(kNan)},
                                      {-3.0, -2.0}}) {
        ray = good;
        ray.tnear = tnear;
        ray.tfar = tfar;
        EXPECT_FALSE(to_scene(space, ray).valid) << tnear << ' ' << tfar;
    }
}

TEST(ToSceneRay, MovesOriginsFromAfarToTheScene) {
    Random random(4);
    const SceneSpace space(WorldBounds{{40, 40, 40}, {42, 42, 42}});
    for (int exponent = 11; exponent <= 44; ++exponent) {
        for (int i = 0; i < 20; ++i) {
            WorldRay ray{{}, {}, 0, kInfinity};
            const auto aim = [&](double from) { return random.real(from, from + 2); };
            const double target[3] = {aim(40), aim(40), aim(40)};
            // As a power of two, so that org + t * dir is exact but for the sum.
            const double t = std::ldexp(1.0, exponent);
            for (int axis = 0; axis < 3; ++axis) {
                ray.dir[axis] = static_cast<float>(random.real(0.5, 1));
                ray.org[axis] = target[axis] - t * ray.dir[axis];
            }
            const SceneRay moved = to_scene(space, ray);
            ASSERT_TRUE(moved.valid) << exponent;
            EXPECT_GT(moved.t_start, 0);
            for (int axis = 0; axis < 3; ++axis) {
                // The target as the rounding of org has it.
                const Real rest = (Real(ray.org[axis]) + Real(t) * Real(ray.dir[axis])) -
                                  Real(space.centre(axis));
                const Real at = std::ldexp(Real(t) - Real(moved.t_start), -moved.t_exponent);
                const Real found = Real(moved.ray.org[axis]) + at * Real(moved.ray.dir[axis]);
                const Real error = found - std::ldexp(rest, space.exponent());
                EXPECT_LE(std::fabs(error), std::max(Real(1), 0x1p-24L * std::fabs(at)))
                    << exponent;
            }
            WorldRay past = ray;
            past.dir = -past.dir;
            EXPECT_FALSE(to_scene(space, past).valid);
        }
    }
}

TEST(ToSceneRay, KeepsRaysWithinWhatTheHitRuleTakes) {
    Random random(1);
    for (const double scale : {1e-44, 1e-20, 1.0, 1e20, 3e38}) {
        const SceneSpace space(WorldBounds{{-scale, -scale, -scale}, {scale, scale, scale}});
        for (int i = 0; i < 20000; ++i) {
            const auto any = [&] { return std::bit_cast<double>(random.bits()); };
            WorldRay world{
                {scale * any(), scale * random.real(0, 1), 0}, {any(), any(), any()}, any(), any()};
            if (i % 2 == 0) world.org[0] = 0;
            if (i % 3 == 0) world.tnear = 0;
            const SceneRay scene = to_scene(space, world);
            if (!scene.valid) continue;
            const Ray& ray = scene.ray;
            EXPECT_GE(ray.tnear, 0);
            EXPECT_LE(ray.tnear, ray.tfar);
            EXPECT_LE(ray.tfar, kInfiniteT);
            EXPECT_TRUE(ray.tnear == 0 || ray.tnear >= 0x1p-100f);
            const vec3 d = ray.dir;
            const float largest = std::max({std::fabs(d.x), std::fabs(d.y), std::fabs(d.z)});
            EXPECT_GE(largest, 1.0f);
            EXPECT_LT(largest, 2.0f);
            for (int axis = 0; axis < 3; ++axis) {
                EXPECT_LE(std::fabs(ray.org[axis]), kOriginExtent);
                const Real steps = std::ldexp(Real(ray.org[axis]), 40);
                EXPECT_EQ(steps, std::nearbyint(steps));
                const Real direction_steps = std::ldexp(Real(d[axis]), 46);
                EXPECT_EQ(direction_steps, std::nearbyint(direction_steps));
                EXPECT_FALSE(d[axis] == 0 && std::signbit(d[axis]));
            }
        }
    }
}

}  // namespace
}  // namespace mray
