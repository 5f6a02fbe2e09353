// Rays in an order in which neighbours are alike.
#include "library/queries/ray_order.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <vector>

#include "tests/library/scenes.h"

namespace mray::test {
namespace {

using morphray::Device;
using morphray::Ray;
using morphray::Scene;
using morphray::detail::RayOrder;
using morphray::detail::RaySorter;

constexpr std::size_t kMany = 20000;

std::vector<Ray> shuffled(std::vector<Ray> rays) {
    std::shuffle(rays.begin(), rays.end(), std::mt19937(5));
    return rays;
}

std::vector<Ray> camera_rays() {
    std::vector<Ray> rays;
    for (int y = 0; y < 100; ++y) {
        for (int x = 0; x < 200; ++x) {
            rays.push_back(
                {.org = {1, 2, 3},
                 .dir = {static_cast<float>(x) / 100 - 1, static_cast<float>(y) / 100, -1}});
        }
    }
    return rays;
}

/// Rays in all directions from a wavy sheet, row by row.
std::vector<Ray> sheet_rays() {
    std::mt19937 random(3);
    std::uniform_real_distribution<float> component(-1, 1);
    std::vector<Ray> rays = camera_rays();
    for (Ray& ray : rays) {
        ray.org = {ray.dir.x, ray.dir.y, std::sin(5 * ray.dir.x)};
        ray.dir = {component(random), component(random), component(random)};
    }
    return rays;
}

std::vector<Ray> random_rays(std::size_t count) {
    std::mt19937 random(1);
    std::uniform_real_distribution<float> component(-1, 1);
    const auto any = [&] {
        const float x = component(random);
        const float y = component(random);
        return morphray::Vec3{x, y, component(random)};
    };
    std::vector<Ray> rays(count);
    for (Ray& ray : rays) ray = {.org = any(), .dir = any()};
    return rays;
}

/// Replaces every 97th ray by one of those that make no sense.
void make_hostile(std::vector<Ray>& rays) {
    constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
    constexpr float kMost = std::numeric_limits<float>::max();
    constexpr float kInf = std::numeric_limits<float>::infinity();
    const Ray hostile[] = {{.org = {kNan, 0, 0}, .dir = {0, 0, 1}},
                           {.org = {0, 0, 0}, .dir = {0, 0, 0}},
                           {.org = {kMost, -kMost, kMost}, .dir = {kMost, kMost, kMost}},
                           {.org = {0, 0, 0}, .dir = {kInf, -kInf, 0}},
                           {.org = {0, kInf, 0}, .dir = {1e-40f, 0, 0}},
                           {.org = {0, 0, 0}, .dir = {kNan, 1, 1}}};
    for (std::size_t i = 0; i < rays.size(); i += 97) rays[i] = hostile[i % std::size(hostile)];
}

bool is_needed(const std::vector<Ray>& rays) { return RayOrder(rays, 1).is_needed(); }

TEST(RayOrder, IsNeededUnlessNeighboursAreAlike) {
    EXPECT_FALSE(is_needed(camera_rays()));
    EXPECT_TRUE(is_needed(shuffled(camera_rays())));
    EXPECT_FALSE(is_needed(sheet_rays()));
    EXPECT_TRUE(is_needed(shuffled(sheet_rays())));
    EXPECT_TRUE(is_needed(random_rays(kMany)));
    EXPECT_FALSE(is_needed(std::vector<Ray>(kMany, {.org = {1, 2, 3}, .dir = {0, 1, 0}})));
}

TEST(RayOrder, IsNotMisledByRaysThatMakeNoSense) {
    std::vector<Ray> rays = camera_rays();
    make_hostile(rays);
    EXPECT_FALSE(is_needed(rays));
    EXPECT_TRUE(is_needed(shuffled(rays)));
    EXPECT_FALSE(is_needed(std::vector<Ray>(
        kMany, {.org = {std::numeric_limits<float>::infinity(), 0, 0}, .dir = {0, 0, 0}})));
}

/// The curve's own formula.
std::uint16_t key_of(const cpu::RayCurve& curve, const Ray& ray) {
    const auto at = cpu::ray_coordinates({{ray.org.x, ray.org.y, ray.org.z},
                                          ray.tnear,
                                          {ray.dir.x, ray.dir.y, ray.dir.z},
                                          ray.tfar});
    std::uint32_t key = 0;
    for (std::size_t k = 0; k < at.size(); ++k) {
        const float cell = std::floor((at[k] - curve.lower[k]) * curve.scale[k]);
        key |= curve.bits[k][static_cast<std::size_t>(
            std::clamp(cell, 0.0f, static_cast<float>(curve.last[k])))];
    }
    return static_cast<std::uint16_t>(key);
}

std::vector<std::uint16_t> keys_of(const RayOrder& order, const std::vector<Ray>& rays,
                                   const SimdTarget& target) {
    std::vector<std::uint16_t> keys(rays.size());
    const cpu::RayKeys ray_keys(order.curve(), target);
    ray_keys.find({reinterpret_cast<const StoredRay*>(rays.data()), rays.size()}, keys);
    return keys;
}

TEST(RayKeys, AreThoseOfTheCurveForEachInstructionSet) {
    for (const std::vector<Ray>& rays : {shuffled(camera_rays()), random_rays(kMany)}) {
        const RayOrder order(rays, 1);
        ASSERT_TRUE(order.is_needed());
        std::vector<std::uint16_t> expected;
        for (const Ray& ray : rays) expected.push_back(key_of(order.curve(), ray));
        for (const std::string& name : morphray::simd_targets()) {
            EXPECT_EQ(keys_of(order, rays, find_simd_target(name)), expected) << name;
        }
        std::sort(expected.begin(), expected.end());
        const auto end = std::unique(expected.begin(), expected.end());
        EXPECT_GT(end - expected.begin(), 5000);
    }
}

TEST(RayKeys, ExistForRaysThatMakeNoSense) {
    std::vector<Ray> rays = random_rays(kMany);
    make_hostile(rays);
    const RayOrder order(rays, 1);
    for (const std::string& name : morphray::simd_targets())
        EXPECT_EQ(keys_of(order, rays, find_simd_target(name)).size(), rays.size());
}

TEST(RaySorter, OrdersByKeysForAnyNumberOfThreads) {
    std::vector<Ray> rays = random_rays(50000);
    make_hostile(rays);
    const RayOrder order(rays, 1);
    const SimdTarget target = find_simd_target("best");
    const std::vector<std::uint16_t> keys = keys_of(order, rays, target);
    std::vector<std::uint32_t> expected(rays.size());
    std::iota(expected.begin(), expected.end(), 0u);
    std::stable_sort(expected.begin(), expected.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return keys[a] < keys[b]; });
    const cpu::RayKeys ray_keys(order.curve(), target);
    RaySorter sorter;
    sorter.make_room(rays.size());
    for (const int threads : {0, 1, 3}) {
        ThreadArena arena(std::max(threads, 1));
        const auto places = sorter.sort(rays, ray_keys, threads == 0 ? nullptr : &arena);
        EXPECT_TRUE(std::ranges::equal(places, expected)) << threads;
    }
    EXPECT_EQ(sorter.sort(std::span(rays).first(1), ray_keys, nullptr).size(), 1u);
    EXPECT_TRUE(sorter.sort({}, ray_keys, nullptr).empty());
}

TEST(Queries, OfManyRaysInAnyOrderAreThoseOfOneRay) {
    const UserMesh mesh(torus(60, 40));
    std::vector<Ray> rays = world_rays(mesh, kMany, 7);
    make_hostile(rays);
    const Scene reference = Scene::build(mesh.view());
    std::vector<morphray::Hit> expected;
    std::vector<std::uint64_t> expected_counts(rays.size());
    for (std::size_t i = 0; i < rays.size(); ++i) {
        expected.push_back(reference.intersect(rays[i]));
        reference.count(std::span(rays).subspan(i, 1), std::span(expected_counts).subspan(i, 1));
    }
    EXPECT_GT(count_hits(expected), kMany / 3);
    std::vector<std::string> targets = morphray::simd_targets();
    targets.push_back("off");
    for (const std::string& simd : targets) {
        for (const int threads : {1, 3}) {
            const Scene scene =
                Scene::build(mesh.view(), Device::cpu({.threads = threads, .simd = simd}));
            expect_same_hits(hits_of(scene, rays), expected, simd);
            std::vector<morphray::Hit> hits(rays.size());
            scene.intersect(rays, std::span(hits), morphray::Threads::calling);
            expect_same_hits(hits, expected, simd);
            std::vector<std::uint8_t> occluded(rays.size(), 2);
            scene.occluded(rays, std::span(occluded));
            for (std::size_t i = 0; i < rays.size(); ++i)
                ASSERT_EQ(occluded[i], expected[i] ? 1 : 0) << simd << ", ray " << i;
            std::vector<std::uint64_t> counts(rays.size(), 99);
            scene.count(rays, counts);
            EXPECT_EQ(counts, expected_counts) << simd;
        }
    }
}

TEST(Queries, OfMoreRaysThanAreSortedAtOnceAreThoseOfSmallCalls) {
    const UserMesh mesh(star(3, 8));
    const Scene scene = Scene::build(mesh.view());
    const std::vector<Ray> rays = world_rays(mesh, RaySorter::kMost + kMany, 9);
    std::vector<morphray::Hit> expected(rays.size());
    for (std::size_t i = 0; i < rays.size(); i += RayOrder::kLeast / 2) {
        const std::size_t size = std::min(RayOrder::kLeast / 2, rays.size() - i);
        scene.intersect(std::span(rays).subspan(i, size), std::span(expected).subspan(i, size));
    }
    expect_same_hits(hits_of(scene, rays), expected);
    std::vector<std::uint64_t> counts(rays.size());
    scene.count(rays, counts, morphray::Crossing::each);
    std::size_t different = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) different += (counts[i] > 0) != bool(expected[i]);
    EXPECT_EQ(different, 0u);
}

TEST(Queries, OfManyRaysInAnyOrderAreCancelled) {
    const UserMesh mesh(torus(60, 40));
    const std::vector<Ray> rays = world_rays(mesh, kMany, 7);
    ASSERT_TRUE(is_needed(rays));
    const Scene scene = Scene::build(mesh.view());
    const morphray::Hit untouched{-1, -2, -3, 77, 88};
    std::vector<morphray::Hit> hits(rays.size(), untouched);
    const std::atomic<bool> cancel = true;
    EXPECT_THROW(scene.intersect(rays, std::span(hits), &cancel), morphray::Error);
    EXPECT_EQ(std::count(hits.begin(), hits.end(), untouched),
              static_cast<std::ptrdiff_t>(hits.size()));
    std::vector<std::uint64_t> counts(rays.size(), 99);
    EXPECT_THROW(scene.count(rays, counts, morphray::Crossing::owner, &cancel), morphray::Error);
    EXPECT_EQ(std::count(counts.begin(), counts.end(), 99u),
              static_cast<std::ptrdiff_t>(counts.size()));
}

}  // namespace
}  // namespace mray::test
