// Rays in an order in which neighbours are alike.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <limits>
#include <thread>
#include <vector>

#include "library/src/query_batches.h"
#include "library/src/ray_order.h"
#include "tests/library/scenes.h"

namespace mray::test {
namespace {

using morphray::Coherence;
using morphray::Device;
using morphray::Ray;
using morphray::Scene;

constexpr std::size_t kMany = 20000;

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
                scene.intersect(rays, hits, {coherence, morphray::Threads::calling});
                expect_same_hits(hits, expected, simd);
                std::vector<std::uint8_t> occluded(rays.size(), 2);
                scene.occluded(rays, occluded, {coherence});
                for (std::size_t i = 0; i < rays.size(); ++i)
                    ASSERT_EQ(occluded[i], expected[i] ? 1 : 0) << simd << ", ray " << i;
                std::vector<std::uint64_t> counts(rays.size(), 99);
                scene.count(rays, counts, morphray::Crossing::once, {coherence});
                EXPECT_EQ(counts, expected_counts) << simd;
            }
        }
    }
}

TEST(Queries, OfRaysThatTakeLongAreAskedInShortRuns) {
    const std::atomic<bool> cancel = false;
    std::vector<std::size_t> runs;
    const auto run_all = [&](const Watch& watch, int us_of_ray) {
        runs.clear();
        morphray::detail::for_runs_of(
            0, 100, watch,
            [&](std::size_t, std::size_t count) {
                std::this_thread::sleep_for(std::chrono::microseconds(us_of_ray) * count);
                runs.push_back(count);
            },
            100, 10);
        return runs;
    };
    EXPECT_EQ(run_all(Watch(&cancel), 400), std::vector<std::size_t>(10, 10));
    EXPECT_EQ(run_all({}, 400), std::vector<std::size_t>{100});
}

TEST(Queries, OfManyRaysInAnyOrderAreCancelled) {
    const UserMesh mesh(torus(60, 40));
    const std::vector<Ray> rays = world_rays(mesh, kMany, 7);
    const Scene scene = Scene::build(mesh.view());
    const morphray::Hit untouched{-1, -2, -3, 77, 88};
    std::vector<morphray::Hit> hits(rays.size(), untouched);
    const std::atomic<bool> cancel = true;
    EXPECT_THROW(scene.intersect(rays, std::span(hits), {Coherence::sort(), {}, {}, {}, &cancel}),
                 morphray::Error);
    EXPECT_EQ(std::count(hits.begin(), hits.end(), untouched),
              static_cast<std::ptrdiff_t>(hits.size()));
    std::vector<std::uint64_t> counts(rays.size(), 99);
    EXPECT_THROW(scene.count(rays, counts, morphray::Crossing::once,
                             {Coherence::sort(), {}, {}, {}, &cancel}),
                 morphray::Error);
    EXPECT_EQ(std::count(counts.begin(), counts.end(), 99u),
              static_cast<std::ptrdiff_t>(counts.size()));
}

}  // namespace
}  // namespace mray::test
