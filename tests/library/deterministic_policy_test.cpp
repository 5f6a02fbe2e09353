// Policies that decide by counts decide the same, however rays are handed over.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <functional>
#include <span>
#include <thread>
#include <vector>

#include "tests/library/scenes.h"

namespace mray::test {
namespace {

using morphray::Box;
using morphray::Device;
using morphray::Scene;
using morphray::Step;

/// The triangles of a mesh, each with vertices of its own.
UserMesh apart(const UserMesh& mesh) {
    UserMesh out;
    for (const std::uint32_t vertex : mesh.triangles) {
        out.triangles.push_back(static_cast<std::uint32_t>(out.points.size()));
        out.points.push_back(mesh.points[vertex]);
    }
    return out;
}

/// Calls `ask` with 6,000 rays at each of 60 poses of a scene whose triangles fly apart. Returns
/// the steps of its updates.
template <class Ask>
std::vector<Step> steps_of_poses(Ask ask) {
    const UserMesh rest = apart(UserMesh(torus(60, 20)));
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

TEST(DeterministicPolicy, CountsTheRaysOfEachScene) {
    const auto ask = [](const Scene& scene, std::span<const morphray::Ray> rays) {
        for (const morphray::Ray& ray : rays) scene.intersect(ray);
    };
    const std::vector<Step> alone = steps_of_poses(ask);
    EXPECT_GT(std::count(alone.begin(), alone.end(), Step::restructure) +
                  std::count(alone.begin(), alone.end(), Step::rebuild) +
                  std::count(alone.begin(), alone.end(), Step::swap),
              0);

    // Another scene is asked in turn.
    const UserMesh other_mesh(icosphere(2));
    const Scene other = Scene::build(other_mesh.view());
    EXPECT_EQ(steps_of_poses([&](const Scene& scene, std::span<const morphray::Ray> rays) {
                  for (const morphray::Ray& ray : rays) {
                      scene.intersect(ray);
                      other.intersect(ray);
                  }
              }),
              alone);
    // In a batch, and as any hits.
    EXPECT_EQ(steps_of_poses([](const Scene& scene, std::span<const morphray::Ray> rays) {
                  std::vector<morphray::Hit> hits(rays.size() / 2);
                  scene.intersect(rays.first(hits.size()), std::span<morphray::Hit>(hits));
                  for (const morphray::Ray& ray : rays.subspan(hits.size())) scene.occluded(ray);
              }),
              alone);
    // In batches of all small sizes, whose times are taken from samples.
    EXPECT_EQ(steps_of_poses([](const Scene& scene, std::span<const morphray::Ray> rays) {
                  std::vector<morphray::Hit> hits(rays.size());
                  std::size_t size = 0;
                  for (std::size_t first = 0; first < rays.size(); first += size) {
                      size = std::min(size % 70 + 1, rays.size() - first);
                      scene.intersect(rays.subspan(first, size),
                                      std::span(hits).subspan(first, size));
                  }
              }),
              alone);
    // By more threads than have counters of their own, at the same time.
    constexpr std::size_t kThreads = 80;
    EXPECT_EQ(steps_of_poses([&](const Scene& scene, std::span<const morphray::Ray> rays) {
                  std::vector<std::thread> threads;
                  const std::size_t share = rays.size() / kThreads;
                  for (std::size_t i = 0; i < kThreads; ++i)
                      threads.emplace_back(ask, std::cref(scene), rays.subspan(i * share, share));
                  for (std::thread& thread : threads) thread.join();
              }),
              alone);
}

}  // namespace
}  // namespace mray::test
