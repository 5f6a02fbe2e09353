// Rays in an order in which neighbours are alike.
#include "library/src/queries/ray_order.h"

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

using morphray::Coherence;
using morphray::Device;
using morphray::Ray;
using morphray::Scene;
using morphray::detail::curve_of;
using morphray::detail::find_tiled_places;
using morphray::detail::kLeastSorted;
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
                {.org = {0.3f, 0.2f, 3},
                 .dir = {static_cast<float>(x) / 100 - 1, static_cast<float>(y) / 100, -1}});
        }
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

std::vector<std::uint16_t> keys_of(const cpu::RayCurve& curve, const std::vector<Ray>& rays,
                                   const SimdTarget& target) {
    std::vector<std::uint16_t> keys(rays.size());
    const cpu::RayKeys ray_keys(curve, target);
    ray_keys.find({reinterpret_cast<const StoredRay*>(rays.data()), rays.size()}, keys);
    return keys;
}

TEST(RayKeys, AreThoseOfTheCurveForEachInstructionSet) {
    for (const std::vector<Ray>& rays : {shuffled(camera_rays()), random_rays(kMany)}) {
        const cpu::RayCurve curve = curve_of(rays, 1);
        std::vector<std::uint16_t> expected;
        for (const Ray& ray : rays) expected.push_back(key_of(curve, ray));
        for (const std::string& name : morphray::simd_targets()) {
            EXPECT_EQ(keys_of(curve, rays, find_simd_target(name)), expected) << name;
        }
        std::sort(expected.begin(), expected.end());
        const auto end = std::unique(expected.begin(), expected.end());
        EXPECT_GT(end - expected.begin(), 5000);
    }
}

TEST(RayKeys, ExistForRaysThatMakeNoSense) {
    std::vector<Ray> rays = random_rays(kMany);
    make_hostile(rays);
    const cpu::RayCurve curve = curve_of(rays, 1);
    for (const std::string& name : morphray::simd_targets())
        EXPECT_EQ(keys_of(curve, rays, find_simd_target(name)).size(), rays.size());
}

TEST(RaySorter, OrdersByKeysForAnyNumberOfThreads) {
    std::vector<Ray> rays = random_rays(50000);
    make_hostile(rays);
    const cpu::RayCurve curve = curve_of(rays, 1);
    const SimdTarget target = find_simd_target("best");
    const std::vector<std::uint16_t> keys = keys_of(curve, rays, target);
    std::vector<std::uint32_t> expected(rays.size());
    std::iota(expected.begin(), expected.end(), 0u);
    std::stable_sort(expected.begin(), expected.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return keys[a] < keys[b]; });
    const cpu::RayKeys ray_keys(curve, target);
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

TEST(TiledPlaces, AreThoseOfNeighboursAndEachComesOnce) {
    const std::pair<std::size_t, std::size_t> sizes[] = {
        {16, 16}, {100, 75}, {1000, 20}, {37, 8}, {40, 3}};
    for (const auto& [row, rows] : sizes) {
        // A last row is cut off.
        const std::size_t total = row * rows + row / 2;
        std::vector<std::size_t> places(total);
        find_tiled_places(row, total, 0, places);
        std::vector<int> times(total);
        for (const std::size_t place : places) ++times[place];
        EXPECT_EQ(times, std::vector<int>(total, 1)) << row;
        for (std::size_t i = 0; i < 64 && rows >= 8; ++i)
            EXPECT_TRUE(places[i] % row < 8 && places[i] / row < 8) << row << ", " << i;
        // In parts of any size.
        for (const std::size_t size : {1u, 7u, 64u, 300u}) {
            std::vector<std::size_t> part;
            for (std::size_t begin = 0; begin < total; begin += size) {
                std::vector<std::size_t> some(std::min(size, total - begin));
                find_tiled_places(row, total, begin, some);
                part.insert(part.end(), some.begin(), some.end());
            }
            EXPECT_EQ(part, places) << row << ", " << size;
        }
    }
}

TEST(Queries, OfManyRaysAreThoseOfOneRayWhateverTheCallerSaysOfThem) {
    const UserMesh mesh(torus(60, 40));
    std::vector<Ray> any_rays = world_rays(mesh, kMany, 7);
    make_hostile(any_rays);
    const Scene reference = Scene::build(mesh.view());
    std::vector<std::string> targets = morphray::simd_targets();
    targets.push_back("off");
    constexpr std::size_t kHuge = std::numeric_limits<std::size_t>::max();
    for (const std::vector<Ray>& rays : {any_rays, camera_rays()}) {
        std::vector<morphray::Hit> expected;
        std::vector<std::uint64_t> expected_counts(rays.size());
        for (std::size_t i = 0; i < rays.size(); ++i) {
            expected.push_back(reference.intersect(rays[i]));
            reference.count(std::span(rays).subspan(i, 1),
                            std::span(expected_counts).subspan(i, 1));
        }
        EXPECT_GT(count_hits(expected), kMany / 50);
        for (const std::string& simd : targets) {
            const Scene scene =
                Scene::build(mesh.view(), Device::cpu({.threads = 3, .simd = simd}));
            for (const Coherence coherence :
                 {Coherence::none(), Coherence::sort(), Coherence::image(0), Coherence::image(9),
                  Coherence::image(200), Coherence::image(kHuge)}) {
                expect_same_hits(hits_of(scene, rays, coherence), expected, simd);
                std::vector<morphray::Hit> hits(rays.size());
                scene.intersect(rays, hits, morphray::Threads::calling, coherence);
                expect_same_hits(hits, expected, simd);
                std::vector<std::uint8_t> occluded(rays.size(), 2);
                scene.occluded(rays, occluded, coherence);
                for (std::size_t i = 0; i < rays.size(); ++i)
                    ASSERT_EQ(occluded[i], expected[i] ? 1 : 0) << simd << ", ray " << i;
                std::vector<std::uint64_t> counts(rays.size(), 99);
                scene.count(rays, counts, morphray::Crossing::owner, coherence);
                EXPECT_EQ(counts, expected_counts) << simd;
            }
        }
    }
}

TEST(Queries, OfMoreRaysThanAreSortedAtOnceAreThoseOfSmallCalls) {
    const UserMesh mesh(star(3, 8));
    const Scene scene = Scene::build(mesh.view());
    const std::vector<Ray> rays = world_rays(mesh, RaySorter::kMost + kMany, 9);
    std::vector<morphray::Hit> expected(rays.size());
    for (std::size_t i = 0; i < rays.size(); i += kLeastSorted / 2) {
        const std::size_t size = std::min(kLeastSorted / 2, rays.size() - i);
        scene.intersect(std::span(rays).subspan(i, size), std::span(expected).subspan(i, size));
    }
    expect_same_hits(hits_of(scene, rays, Coherence::sort()), expected);
    std::vector<std::uint64_t> counts(rays.size());
    scene.count(rays, counts, morphray::Crossing::each, Coherence::sort());
    std::size_t different = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) different += (counts[i] > 0) != bool(expected[i]);
    EXPECT_EQ(different, 0u);
}

TEST(Queries, OfManyRaysInAnyOrderAreCancelled) {
    const UserMesh mesh(torus(60, 40));
    const std::vector<Ray> rays = world_rays(mesh, kMany, 7);
    const Scene scene = Scene::build(mesh.view());
    const morphray::Hit untouched{-1, -2, -3, 77, 88};
    std::vector<morphray::Hit> hits(rays.size(), untouched);
    const std::atomic<bool> cancel = true;
    EXPECT_THROW(scene.intersect(rays, std::span(hits), Coherence::sort(), &cancel),
                 morphray::Error);
    EXPECT_EQ(std::count(hits.begin(), hits.end(), untouched),
              static_cast<std::ptrdiff_t>(hits.size()));
    std::vector<std::uint64_t> counts(rays.size(), 99);
    EXPECT_THROW(scene.count(rays, counts, morphray::Crossing::owner, Coherence::sort(), &cancel),
                 morphray::Error);
    EXPECT_EQ(std::count(counts.begin(), counts.end(), 99u),
              static_cast<std::ptrdiff_t>(counts.size()));
}

}  // namespace
}  // namespace mray::test
