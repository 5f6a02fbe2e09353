// Rays of the caller come into scene space with the bits of the engine's own conversion.
#include "library/world_ray.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "tests/support/test_scene.h"

namespace mray::test {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kDenormal = std::numeric_limits<float>::denorm_min();
constexpr float kMost = std::numeric_limits<float>::max();

SceneSpace space_of(double lower, double upper) {
    WorldBounds bounds;
    const double corners[2][3] = {{lower, lower / 2, lower}, {upper, upper, upper / 4}};
    bounds.extend(corners[0], corners[0]);
    bounds.extend(corners[1], corners[1]);
    return SceneSpace(bounds);
}

std::vector<SceneSpace> spaces() {
    return {SceneSpace(WorldBounds{}), space_of(-1, 1),       space_of(100, 104),
            space_of(-1e-30, 3e-30),   space_of(-2e38, 3e38), space_of(0, kDenormal)};
}

void expect_same(const SceneSpace& space, const morphray::Ray& ray) {
    const morphray::detail::RayConverter converter(space);
    Ray actual;
    const morphray::detail::RayScale scale = converter.to_scene(ray, actual);
    const SceneRay expected = to_scene(space, {{ray.org.x, ray.org.y, ray.org.z},
                                               {ray.dir.x, ray.dir.y, ray.dir.z},
                                               ray.tnear,
                                               ray.tfar});
    ASSERT_EQ(scale.is_valid, expected.valid);
    if (!expected.valid) return;
    EXPECT_EQ(scale.t_exponent, expected.t_exponent);
    EXPECT_EQ(std::memcmp(&actual, &expected.ray, sizeof(Ray)), 0);
}

TEST(RayConverter, GivesTheBitsOfTheEngine) {
    Random random(5);
    const auto any_float = [&] {
        return std::bit_cast<float>(static_cast<std::uint32_t>(random.bits()));
    };
    std::size_t valid = 0;
    for (const SceneSpace& space : spaces()) {
        for (int i = 0; i < 20000; ++i) {
            const float size = std::ldexp(1.0f, -space.exponent() / 2 + 10);
            const auto some = [&] {
                return i % 3 == 0 ? any_float() : size * static_cast<float>(random.real(-1, 1));
            };
            const morphray::Ray ray{{some(), some(), some()},
                                    i % 4 == 0 ? any_float() : 0.0f,
                                    {some(), some(), some()},
                                    i % 5 == 0 ? any_float() : kInfinity};
            Ray scene;
            valid += morphray::detail::RayConverter(space).to_scene(ray, scene).is_valid ? 1 : 0;
            expect_same(space, ray);
            if (HasFailure()) return;
        }
    }
    EXPECT_GT(valid, 20000u);
}

TEST(RayConverter, GivesTheBitsOfTheEngineForHostileRays) {
    const float values[] = {0,      -0.0f,     1,          -1,   kDenormal, -kDenormal,   kMost,
                            -kMost, kInfinity, -kInfinity, kNan, 0x1p-60f,  0x1.fffffep0f};
    for (const SceneSpace& space : spaces()) {
        for (const float a : values) {
            for (const float b : values) {
                expect_same(space, {{a, b, 0}, 0, {0, 0, 1}, kInfinity});
                expect_same(space, {{0, 0, 0}, 0, {a, b, 1}, kInfinity});
                expect_same(space, {{0, 0, 0}, 0, {a, b, b}, kInfinity});
                expect_same(space, {{0, 0, 0}, a, {0, 1, 0}, b});
            }
        }
    }
}

TEST(RayConverter, TurnsTBackExactly) {
    morphray::Hit hit;
    morphray::detail::to_world(Hit{0.75f, 0.5f, 0.25f, 7}, {3, true}, hit);
    EXPECT_EQ(hit, (morphray::Hit{6, 0.5f, 0.25f, 7, 0}));
    morphray::detail::to_world(Hit{1.5f, 0.5f, 0.25f, 7}, {300, true}, hit);
    EXPECT_EQ(hit.t, kMost);
    morphray::detail::to_world(no_hit(), {3, true}, hit);
    EXPECT_EQ(hit, morphray::Hit{});
}

}  // namespace
}  // namespace mray::test
