// Rays are counted exactly, so that policies which decide by counts decide the same in all runs.
#include "library/src/query_cost.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

#include "tests/library/scenes.h"
#include "tests/support/run_together.h"

namespace mray::test {
namespace {

using morphray::Box;
using morphray::Device;
using morphray::Scene;
using morphray::Step;

TEST(QueryCost, CountsTheRaysOfAllThreadsSinceTheLastReset) {
    morphray::detail::QueryCost cost;
    // More threads than there are counters, and calls of all small sizes.
    constexpr std::size_t kThreads = 80;
    for (int pose = 0; pose < 3; ++pose) {
        run_together(kThreads, [&](std::size_t thread) {
            for (std::size_t size = 1; size <= 70; ++size) cost.measure(size, [] {});
            cost.add(0.5, thread);
        });
        EXPECT_EQ(cost.rays(), kThreads * 70 * 71 / 2 + kThreads * (kThreads - 1) / 2);
        EXPECT_GE(cost.ms(), 0.5 * kThreads);
        cost.reset();
        EXPECT_EQ(cost.rays(), 0u);
        EXPECT_EQ(cost.ms(), 0);
    }
}

/// Calls `ask` with 6,000 rays at each of 60 poses of a scene whose triangles fly apart. Returns
/// the steps of its updates.
template <class Ask>
std::vector<Step> steps_of_poses(Ask ask) {
    const UserMesh whole(torus(60, 20));
    UserMesh rest;
    for (const std::uint32_t vertex : whole.triangles) {
        rest.triangles.push_back(static_cast<std::uint32_t>(rest.points.size()));
        rest.points.push_back(whole.points[vertex]);
    }
    UserMesh mesh = rest;
    Scene scene = Scene::build(mesh.view(), Device::cpu({.threads = 1}),
                               {.bounds = Box{{-30, -30, -30}, {30, 30, 30}},
                                .update = morphray::Auto{.deterministic = true}});
    std::vector<Step> steps;
    for (int pose = 1; pose <= 60; ++pose) {
        for (std::size_t i = 0; i < mesh.points.size(); ++i) {
            const std::size_t triangle = i / 3;
            const float way = 0.02f * static_cast<float>(pose);
            const morphray::Vec3 p = rest.points[i];
            mesh.points[i] = {p.x + way * static_cast<float>(triangle * 7 % 11),
                              p.y - way * static_cast<float>(triangle * 5 % 13),
                              p.z + way * static_cast<float>(triangle * 3 % 7)};
        }
        steps.push_back(scene.update().step);
        ask(scene, world_rays(mesh, 6000, static_cast<std::uint64_t>(pose)));
    }
    return steps;
}

TEST(QueryCost, DoesNotDependOnHowRaysAreHandedOver) {
    // Another scene is asked in turn.
    const UserMesh other_mesh(icosphere(2));
    const Scene other = Scene::build(other_mesh.view());
    const std::vector<Step> alone =
        steps_of_poses([&](const Scene& scene, std::span<const morphray::Ray> rays) {
            for (const morphray::Ray& ray : rays) {
                scene.intersect(ray);
                other.intersect(ray);
            }
        });
    EXPECT_GT(std::count(alone.begin(), alone.end(), Step::restructure) +
                  std::count(alone.begin(), alone.end(), Step::rebuild) +
                  std::count(alone.begin(), alone.end(), Step::swap),
              0);
    EXPECT_EQ(steps_of_poses([](const Scene& scene, std::span<const morphray::Ray> rays) {
                  std::vector<morphray::Hit> hits(rays.size() / 2);
                  scene.intersect(rays.first(hits.size()), std::span<morphray::Hit>(hits));
                  for (const morphray::Ray& ray : rays.subspan(hits.size())) scene.occluded(ray);
              }),
              alone);
}

}  // namespace
}  // namespace mray::test
