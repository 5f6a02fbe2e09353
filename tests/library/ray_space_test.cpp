// Rays of the caller come into scene space with the bits of mray::to_scene().
#include "library/src/ray_space.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include <glm/common.hpp>

#include "common/simd/simd_target.h"
#include "cpu/scene_space/to_scene.h"
#include "tests/support/same_bits.h"
#include "tests/support/test_scene.h"

namespace mray::test {
namespace {

using morphray::detail::RaySpace;

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kDenormal = std::numeric_limits<float>::denorm_min();
constexpr float kMost = std::numeric_limits<float>::max();

SceneSpace space_of(double lower, double upper) {
    const glm::dvec3 from = {lower, lower / 2, lower};
    const glm::dvec3 to = {upper, upper, upper / 4};
    return SceneSpace(WorldBounds{glm::min(from, to), glm::max(from, to)});
}

std::vector<SceneSpace> spaces() {
    return {SceneSpace(WorldBounds{}), space_of(-1, 1),       space_of(100, 104),
            space_of(-1e-30, 3e-30),   space_of(-2e38, 3e38), space_of(0, kDenormal)};
}

SceneRay to_scene_of(const SceneSpace& space, const StoredRay& r) {
    return to_scene(
        space, {{r.org[0], r.org[1], r.org[2]}, {r.dir[0], r.dir[1], r.dir[2]}, r.tnear, r.tfar});
}

void expect_same(const SceneSpace& space, const StoredRay& stored) {
    const morphray::Ray ray{{stored.org[0], stored.org[1], stored.org[2]},
                            stored.tnear,
                            {stored.dir[0], stored.dir[1], stored.dir[2]},
                            stored.tfar};
    const RaySpace rays(space, best_simd_target());
    Ray actual;
    const std::optional<int> t_exponent = rays.to_scene(ray, actual);
    const SceneRay expected = to_scene_of(space, stored);
    ASSERT_EQ(t_exponent.has_value(), expected.valid);
    if (!expected.valid) return;
    EXPECT_EQ(*t_exponent,
              expected.t_exponent + (expected.t_start != 0 ? morphray::detail::kFarRay : 0));
    EXPECT_EQ(rays.t_exponent(ray.dir), expected.t_exponent);
    EXPECT_EQ(std::memcmp(&actual, &expected.ray, sizeof(Ray)), 0);
}

TEST(RaySpace, TurnsTBackExactly) {
    using morphray::detail::to_world_t;
    EXPECT_EQ(to_world_t(0.75f, 3), 6.0f);
    EXPECT_EQ(to_world_t(1.5f, -126), 0x1.8p-126f);
    EXPECT_EQ(to_world_t(1.5f, -127), 0x1.8p-127f);
    EXPECT_EQ(to_world_t(0x1.8p40f, -180), 0x1.8p-140f);
    EXPECT_EQ(to_world_t(1.5f, 126), 0x1.8p126f);
    EXPECT_EQ(to_world_t(1.5f, 127), 0x1.8p127f);
    EXPECT_EQ(to_world_t(8, 126), kMost);
    EXPECT_EQ(to_world_t(1.5f, 300), kMost);
    EXPECT_EQ(to_world_t(0, 300), 0.0f);
}

/// So does RaySpace with the same rays.
TEST(MakeSceneRays, GivesTheBitsOfTheEngineOnEachTarget) {
    Random random(6);
    std::size_t made = 0;
    const float values[] = {
        0,         -0.0f,      1,    -1,       kDenormal,     -kDenormal, kMost,   -kMost,
        kInfinity, -kInfinity, kNan, 0x1p-60f, 0x1.fffffep0f, 0x1p-126f,  0x1p126f};
    for (const SceneSpace& space : spaces()) {
        const float size = std::ldexp(1.0f, std::clamp(-space.exponent() + 20, -140, 120));
        const auto usual = [&] { return size * static_cast<float>(random.real(-1, 1)); };
        const auto any = [&] {
            const std::uint32_t kind = random.below(24);
            if (kind == 0) return std::bit_cast<float>(static_cast<std::uint32_t>(random.bits()));
            return kind < 3 ? values[random.below(std::size(values))] : usual();
        };
        for (int batch = 0; batch < 60; ++batch) {
            std::vector<StoredRay> rays(1 + random.below(cpu::SceneRays::kMost));
            for (StoredRay& ray : rays) {
                ray = {{any(), any(), any()}, 0, {any(), any(), any()}, kInfinity};
                if (random.below(5) == 0) ray.tnear = any();
                if (random.below(5) == 0) ray.tfar = any();
                // Close to the farthest origin that is not moved.
                if (random.below(9) == 0) {
                    ray.org[random.below(3)] =
                        static_cast<float>(space.centre(0)) +
                        std::ldexp(static_cast<float>(random.real(0.999999, 1.000001)),
                                   std::clamp(30 - space.exponent(), -140, 127));
                }
            }
            for (const StoredRay& r : rays) {
                expect_same(space, r);
                if (HasFailure()) return;
            }
            for (const SimdTarget& target : supported_simd_targets()) {
                cpu::SceneRays out;
                cpu::make_scene_rays(space, target, rays, out);
                std::size_t hard = 0;
                for (std::size_t i = 0; i < rays.size(); ++i) {
                    if (hard < out.hard_count && out.hard[hard] == i) {
                        ++hard;
                        continue;
                    }
                    ++made;
                    const SceneRay expected = to_scene_of(space, rays[i]);
                    ASSERT_TRUE(expected.valid) << target.name;
                    ASSERT_EQ(out.t_exponents[2 * i + 1], expected.t_exponent) << target.name;
                    ASSERT_EQ(std::memcmp(&out.rays[i], &expected.ray, sizeof(Ray)), 0)
                        << target.name;
                }
                ASSERT_EQ(hard, out.hard_count);
            }
        }
    }
    // Without vectors every ray is hard.
    const bool has_vectors = std::string_view(best_simd_target().name) != "scalar";
    EXPECT_EQ(made > 20000u, has_vectors);
}

TEST(MakePositions, GivesTheBitsOfTheEngineOnEachTarget) {
    Random random(8);
    for (const SceneSpace& space : spaces()) {
        const float size = std::ldexp(1.0f, std::clamp(20 - space.exponent(), -140, 126));
        for (int batch = 0; batch < 40; ++batch) {
            const bool hostile = batch % 4 == 0;
            std::vector<vec3> world(random.below(700));
            bool any_outside = false;
            bool all_invertible = true;
            std::vector<vec3> expected;
            for (vec3& p : world) {
                for (int axis = 0; axis < 3; ++axis) {
                    p[axis] = static_cast<float>(space.centre(axis)) +
                              size * static_cast<float>(random.real(-0.7, 0.7)) *
                                  std::ldexp(1.0f, -static_cast<int>(random.below(60)));
                    if (hostile && random.below(50) == 0)
                        p[axis] = std::bit_cast<float>(static_cast<std::uint32_t>(random.bits()));
                }
                const vec3 scene = space.to_scene(p);
                expected.push_back(scene);
                all_invertible &= space.to_world(scene) == p;
                const bool finite = std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
                for (int axis = 0; axis < 3; ++axis)
                    any_outside |= finite && !(std::abs(scene[axis]) <= kSceneExtent);
            }
            for (const SimdTarget& target : supported_simd_targets()) {
                std::vector<vec3> actual(world.size());
                const cpu::MadePositions made = cpu::make_positions(space, target, world, actual);
                ASSERT_EQ(made.any_outside, any_outside) << target.name;
                ASSERT_EQ(made.all_invertible, all_invertible) << target.name;
                ASSERT_TRUE(same_bytes(actual, expected)) << target.name;
            }
        }
    }
}

}  // namespace
}  // namespace mray::test
