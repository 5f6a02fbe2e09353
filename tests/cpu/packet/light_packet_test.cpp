// Light packets where their plane serves them badly: rays in all directions, and triangles that
// reach past the light.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/bvh/builder/bvh_builder.h"
#include "cpu/packet/packet_tracer.h"
#include "cpu/reference/scalar_tracer.h"
#include "tests/cpu/packet/light_rays.h"
#include "tests/cpu/packet/wedge_check.h"
#include "tests/support/test_scene.h"

namespace mray {
namespace {

using namespace test;

/// Tells how many rays a packet left to others, and how many of the rest are occluded.
struct PacketAnswers {
    std::size_t fallback = 0;
    std::size_t dark = 0;
};

class LightPackets : public testing::TestWithParam<SimdTarget> {
protected:
    /// Expects of all rays but fallback rays what brute force says.
    PacketAnswers check(const TestScene& scene, std::span<const Ray> rays,
                        std::span<const std::uint8_t> active) {
        const Bvh bvh = build_bvh(scene.topology(), scene.positions());
        const cpu::PacketTracer tracer(bvh, GetParam());
        const cpu::BruteTracer brute(scene.topology(), scene.positions());
        std::vector<std::uint8_t> occluded(rays.size(), 9);
        std::vector<std::uint16_t> fallback(rays.size());
        fallback.resize(tracer.occluded_shared_origin(rays[0].org, blocks_of(rays, active),
                                                      *packet_, occluded.data(), fallback.data()));
        std::vector<std::uint8_t> is_fallback(rays.size());
        for (const std::uint16_t ray : fallback) {
            EXPECT_TRUE(active[ray] != 0 && is_fallback[ray] == 0);
            is_fallback[ray] = 1;
        }
        PacketAnswers answers{fallback.size(), 0};
        std::size_t wrong = 0;
        for (std::size_t i = 0; i < rays.size(); ++i) {
            if (is_fallback[i] != 0) continue;
            const int expected = active[i] == 0 || brute.occluded(rays[i]) ? 1 : 0;
            wrong += occluded[i] != expected;
            answers.dark += active[i] != 0 && expected != 0;
        }
        EXPECT_EQ(wrong, 0u);
        return answers;
    }

    std::unique_ptr<cpu::LightPacket> packet_ = std::make_unique<cpu::LightPacket>();
};

TEST_P(LightPackets, HaveWedgesThatHoldAllRays) {
    std::uint32_t sides = 0;
    for (std::uint64_t seed = 0; seed < 40; ++seed) {
        Random random(seed);
        const TestScene scene = random_soup(20, 0.3, seed);
        const vec3 org = snap_point(random.point(0.3 * kSceneExtent));
        vec3 middle = org + random.point(0.4 * kSceneExtent);
        middle[static_cast<int>(seed % 3)] += (seed % 2 == 0 ? 1 : -1) * kSceneExtent;
        // Some blocks are so wide that they are regrouped.
        const double spread = static_cast<double>(seed % 4 + 1) * 0.1 * kSceneExtent;
        std::vector<Ray> rays;
        for (std::size_t i = 0; i < cpu::kSquareRays; ++i) {
            const double own = i % 64 < 16 ? spread : 0.3 * spread;
            rays.push_back(ray_towards(org, middle + random.point(own), 2));
        }
        const std::vector<std::uint8_t> all(rays.size(), 1);
        EXPECT_EQ(check(scene, rays, all).fallback, 0u);
        EXPECT_GT(packet_->regrouped_count, 0u);
        const cpu::PacketFrame& frame = packet_->frame;
        for (const Ray& ray : rays)
            EXPECT_GE(least_inside_wedges(frame, ray.dir), -0x1p-23) << "seed " << seed;
        sides += frame.wedge_side_count;
    }
    EXPECT_GT(sides, 40u);
}

TEST_P(LightPackets, TraceRaysInAllDirectionsByFaces) {
    for (std::uint64_t seed = 0; seed < 4; ++seed) {
        Random random(seed);
        const TestScene scene = random_soup(200, 0.3, seed);
        const vec3 org = snap_point(random.point(0.3 * kSceneExtent));
        const std::size_t count = cpu::kSquareRays * (4 - seed);
        std::vector<Ray> rays;
        for (std::size_t i = 0; i < count; ++i)
            rays.push_back(ray_towards(org, org + random.point(kSceneExtent), 2));
        const PacketAnswers all = check(scene, rays, std::vector<std::uint8_t>(count, 1));
        EXPECT_EQ(all.fallback, 0u);
        EXPECT_GT(all.dark, count / 20);
        EXPECT_LT(all.dark, count);
        std::vector<std::uint8_t> some(count);
        for (std::size_t i = 0; i < count; ++i)
            some[i] = i % 5 == 0 || rays[i].dir.x > std::abs(rays[i].dir.y);
        EXPECT_LT(check(scene, rays, some).fallback, count / 4);
    }
}

TEST_P(LightPackets, LeaveAFewRaysInAllDirectionsToOthers) {
    Random random(7);
    const TestScene scene = random_soup(50, 0.3, 7);
    std::vector<Ray> rays;
    std::vector<std::uint8_t> active(cpu::kSquareRays);
    for (std::size_t i = 0; i < active.size(); ++i) {
        rays.push_back(ray_towards({0, 0, 0}, random.point(kSceneExtent), 1));
        active[i] = i % 32 == 3;
    }
    EXPECT_EQ(check(scene, rays, active).fallback, active.size() / 32);
    EXPECT_EQ(check(scene, rays, std::vector<std::uint8_t>(rays.size(), 0)).fallback, 0u);
}

/// Rays towards one side of `org`: a third anywhere in a cone, the others at triangles.
std::vector<Ray> rays_at(const TestScene& scene, vec3 org, std::uint64_t seed) {
    Random random(seed);
    const vec3 towards = org + random.point(kSceneExtent);
    const double spread = std::ldexp(kSceneExtent, -static_cast<int>(seed % 6));
    std::vector<Ray> rays;
    for (std::uint32_t i = 0; i < cpu::kSquareRays; ++i) {
        vec3 target = towards + random.point(spread);
        if (i % 3 != 0) {
            const std::uint32_t t =
                random.below(static_cast<std::uint32_t>(scene.triangle_count()));
            const vec3* const corner = &scene.positions()[3 * t];
            const auto u = static_cast<float>(random.real(0, 1));
            const auto v = static_cast<float>(random.real(0, 1 - u));
            target = corner[0] + (corner[1] - corner[0]) * u + (corner[2] - corner[0]) * v;
        }
        const bool is_there = dot3(target - org, towards - org) > 0;
        rays.push_back(ray_towards(org, is_there ? target : towards, i % 2 == 0 ? 2 : 8));
    }
    return rays;
}

/// Ends rays at what they hit, moved by 2^-12 to 2^-24 of the way to either side.
void end_at_hits(const TestScene& scene, Random& random, std::vector<Ray>& rays) {
    const cpu::BruteTracer brute(scene.topology(), scene.positions());
    for (Ray& ray : rays) {
        ray.tfar = kInfiniteT;
        const Hit hit = brute.intersect(ray);
        const float side = random.below(4) == 0 ? 1.0f : -1.0f;
        const float step = std::ldexp(side, -12 - static_cast<int>(random.below(13)));
        ray.tfar = hit.prim_id == kNoPrim ? 2 * kSceneExtent : hit.t * (1 + step);
    }
}

TEST_P(LightPackets, AnswerLikeBruteForceAmongTrianglesThatReachPastTheLight) {
    for (const bool at_surfaces : {false, true}) {
        PacketAnswers sum;
        const std::uint64_t seeds = at_surfaces ? 60 : 300;
        for (std::uint64_t seed = 0; seed < seeds; ++seed) {
            Random random(seed);
            const vec3 light = random.point(0.3);
            const TestScene scene = at_surfaces && seed % 2 != 0
                                        ? random_soup(12, seed % 4 == 1 ? 4 : 0.5, seed)
                                        : triangles_past(light, seed);
            const vec3 org = snap_point(scene.space().to_scene(light));
            std::vector<Ray> rays = rays_at(scene, org, seed);
            if (at_surfaces) end_at_hits(scene, random, rays);
            const PacketAnswers own = check(scene, rays, std::vector<std::uint8_t>(rays.size(), 1));
            sum.dark += own.dark;
            sum.fallback += own.fallback;
        }
        const std::size_t count = seeds * cpu::kSquareRays;
        EXPECT_LT(sum.fallback, count / 10);
        EXPECT_GT(sum.dark, count / (at_surfaces ? 20 : 10));
        EXPECT_LT(sum.dark, at_surfaces ? count / 2 : count - count / 10);
    }
}

TEST_P(LightPackets, AnswerLikeBruteForceForFullPartialAndEmptyMasksOnEveryScene) {
    std::size_t decided = 0;
    for (const NamedScene& named : adversarial_scenes()) {
        for (std::uint64_t seed = 0; seed < 12; ++seed) {
            SCOPED_TRACE(named.name + ", seed " + std::to_string(seed));
            Random random(seed);
            const vec3 org = snap_point(random.point((seed % 3 == 0 ? 0.5 : 3) * kSceneExtent));
            const vec3 towards = random.point(kSceneExtent);
            const double spread = std::ldexp(kSceneExtent, -static_cast<int>(random.below(16)));
            std::vector<Ray> rays;
            std::vector<std::uint8_t> active;
            const std::size_t count = cpu::kSquareRays * (4 - seed % 4);
            for (std::size_t i = 0; i < count; ++i) {
                const vec3 target = towards + random.point(spread);
                rays.push_back(ray_towards(org, target, seed % 2 == 0 ? 1 : 4));
                active.push_back(seed == 3 ? 0 : seed == 4 ? i % 5 == 0 : seed == 5 ? i == 700 : 1);
            }
            decided += count - check(named.scene, rays, active).fallback;
        }
    }
    EXPECT_GT(decided, 100u * cpu::kSquareRays);
}

INSTANTIATE_TEST_SUITE_P(Packets, LightPackets, testing::ValuesIn(supported_simd_targets()),
                         [](const auto& target) { return std::string(target.param.name); });

}  // namespace
}  // namespace mray
