// The promises about threads in library/include/morphray/. Answers are compared here; races without
// a wrong answer are seen by ThreadSanitizer (cmake/tsan/run).
#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <variant>
#include <vector>

#include "library/src/query_cost.h"
#include "tests/library/answers.h"
#include "tests/support/run_together.h"

namespace mray::test {
namespace {

using morphray::Device;
using morphray::Scene;

using Answer = std::variant<std::uint64_t, std::string, std::vector<morphray::Hit>,
                            std::vector<std::uint8_t>, std::vector<std::uint64_t>, PointAnswers>;

/// Calls of all const members.
std::vector<std::function<Answer()>> questions_about(const Scene& scene,
                                                     const std::vector<morphray::Ray>& rays,
                                                     const std::vector<morphray::Vec3>& points) {
    const auto hash_of = [&scene](const morphray::View& view) {
        return scene.render(view).hits_hash;
    };
    return {
        [&] { return hits_of(scene, rays); },
        [&] {
            std::vector<morphray::Hit> hits(rays.size());
            scene.intersect(rays, hits, {.threads = morphray::Threads::calling});
            return hits;
        },
        [&] {
            std::vector<morphray::Hit> hits;
            for (std::size_t i = 0; i < rays.size(); i += 16) {
                hits.push_back(scene.intersect(rays[i]));
                hits.push_back(scene.intersect(rays[i], hits.back()));
                hits.push_back(
                    scene.intersect(rays[i], {.visible = std::array<std::uint8_t, 1>{0}}));
            }
            return hits;
        },
        [&] {
            std::vector<std::uint8_t> occluded(rays.size());
            scene.occluded(rays, occluded);
            for (std::size_t i = 0; i < rays.size(); i += 16)
                occluded.push_back(scene.occluded(rays[i]) ? 1 : 0);
            return occluded;
        },
        [&] { return scene.intersect_all(rays).hits; },
        [&] {
            std::vector<std::uint64_t> counts(rays.size());
            scene.count(rays, counts);
            return counts;
        },
        [&] { return PointAnswers(scene, points); },
        [=] { return hash_of({.width = 70, .height = 40}); },
        [=] {
            return hash_of({.width = 30, .height = 20, .rays = morphray::Rays::ao, .ao_count = 4});
        },
        [=] {
            return hash_of(
                {.width = 30, .height = 20, .shading = morphray::Shading::lit, .ao_count = 2});
        },
        [&] { return scene.on(scene.device()).tree_statistics().hash; },
        [&] { return scene.tree_statistics().hash; },
        [&] { return scene.tree_boxes(2).size(); },
        [&] { return scene.device().description(); },
        [&] { return scene.triangle_count() + scene.vertex_count(); },
        [&] { return std::to_string(scene.bounds().lower[0]); },
        [&] { return static_cast<std::uint64_t>(scene.last_update().step); },
        [&] { return compare(scene, scene, rays).different; },
    };
}

/// Asks all const members, in an order that differs with `turn`, so that each is the first one in
/// some thread. Points are the origins of the rays.
std::vector<Answer> ask(const Scene& scene, const std::vector<morphray::Ray>& rays,
                        std::size_t turn) {
    std::vector<morphray::Vec3> points;
    for (const morphray::Ray& ray : rays) points.push_back(ray.org);
    const std::vector<std::function<Answer()>> questions = questions_about(scene, rays, points);
    std::vector<Answer> answers(questions.size());
    for (std::size_t i = 0; i < questions.size(); ++i) {
        const std::size_t k = (i + turn) % questions.size();
        answers[k] = questions[k]();
    }
    return answers;
}

TEST(Threads, AskAllConstMembersAtTheSameTime) {
    UserMesh mesh(torus(40, 24));
    const std::vector<morphray::Ray> many = world_rays(mesh, 1500, 7);
    for (const Device& device : {Device::cpu({.threads = 2}), Device::brute_force()}) {
        // More than a thread answers alone; brute force takes seconds for all.
        const std::vector<morphray::Ray> rays(many.begin(),
                                              many.begin() + (device.name() == "cpu" ? 1500 : 300));
        // One that no thread has asked before, since first questions make what later ones use.
        Scene scene = Scene::build(mesh.view(), device, {.record_cost_ratio = true});
        Scene other = Scene::build(mesh.view(), device, {.record_cost_ratio = true});
        for (int pose = 0; pose < 2; ++pose) {
            const std::vector<Answer> expected = ask(other, rays, 0);
            std::atomic<int> different = 0;
            run_together(5, [&](std::size_t i) {
                different += ask(scene, rays, 4 * i) == expected ? 0 : 1;
            });
            EXPECT_EQ(different, 0) << device.name() << ", pose " << pose;
            for (morphray::Vec3& point : mesh.points) point.x *= 1.25f;
            scene.update();
            other.update();
        }
    }
}

/// Rays are counted exactly, so that policies which decide by counts decide the same in all runs.
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

TEST(Threads, UpdateASceneWhileOthersAskItsCopy) {
    UserMesh mesh(torus(30, 20));
    const std::vector<morphray::Ray> rays = world_rays(mesh, 500, 12);
    Scene scene = Scene::build(mesh.view(), Device::cpu(), {.update = morphray::Rebuild{}});
    const Scene copy = scene.on(Device::cpu());
    const std::vector<morphray::Hit> expected = hits_of(copy, rays);
    std::atomic<int> different = 0;
    const auto question = [&] {
        for (int i = 0; i < 20; ++i) {
            different += hits_of(copy, rays) == expected ? 0 : 1;
            different += copy.intersect_all(rays).hits.empty() ? 1 : 0;
            copy.tree_statistics();
        }
    };
    run_together({question, question, [&] {
                      for (int i = 0; i < 20; ++i) {
                          for (morphray::Vec3& point : mesh.points) point.y += 0.05f * point.x;
                          scene.update();
                      }
                  }});
    EXPECT_EQ(different, 0);
}

/// Trees that are built in the background, while threads ask and the caller writes its positions.
/// A deterministic policy counts the rays of all threads, so its step is that of a scene that one
/// thread asks.
TEST(Threads, AskWhileATreeIsBuiltInTheBackground) {
    // Triangles that fly apart.
    const UserMesh rest(random_soup(1000, 0.1, 8));
    UserMesh mesh = rest;
    const std::vector<morphray::Ray> rays = world_rays(mesh, 2000, 23);
    const morphray::SceneOptions options{.update =
                                             morphray::Auto{.budget = 0.05, .deterministic = true}};
    Scene scene = Scene::build(mesh.view(), Device::cpu({.threads = 2}), options);
    Scene twin = Scene::build(mesh.view(), Device::cpu({.threads = 1}), options);
    const auto move = [&](int step) {
        const float way = 0.01f * static_cast<float>(step);
        for (std::size_t i = 0; i < mesh.points.size(); ++i) {
            mesh.points[i].x = rest.points[i].x + way * static_cast<float>(i / 3 * 7 % 11);
            mesh.points[i].y = rest.points[i].y + way * static_cast<float>(i / 3 * 5 % 13);
        }
    };
    // A build that has begun does not keep the caller from the next pose.
    const auto advance = [&](Scene& moving, int pose) {
        move(2 * pose);
        if (!moving.update().build_pending) return moving.last_update();
        move(2 * pose + 1);
        return moving.update();
    };
    int pending = 0;
    int swaps = 0;
    for (int pose = 0; pose < 40; ++pose) {
        const morphray::Update update = advance(scene, pose);
        const morphray::Update same = advance(twin, pose);
        ASSERT_EQ(update.step, same.step) << pose;
        ASSERT_EQ(update.cost_ratio, same.cost_ratio) << pose;
        ASSERT_EQ(update.build_pending, same.build_pending) << pose;
        pending += update.build_pending ? 1 : 0;
        swaps += update.step == morphray::Step::swap ? 1 : 0;
        constexpr std::size_t kThreads = 4;
        const std::vector<morphray::Hit> expected = hits_of(twin, rays);
        // The twin is asked as many rays, but one by one.
        for (std::size_t i = 0; i < (kThreads - 1) * rays.size() + kThreads * 100; ++i) {
            const morphray::Ray& ray = rays[i % rays.size()];
            if (i % 2 == 0) twin.intersect(ray);
            if (i % 2 == 1) twin.occluded(ray);
        }
        std::atomic<int> different = 0;
        run_together(kThreads, [&](std::size_t thread) {
            int mine = hits_of(scene, rays) == expected ? 0 : 1;
            for (std::size_t i = 100 * thread; i < 100 * (thread + 1); ++i)
                mine += scene.intersect(rays[i]) == expected[i] ? 0 : 1;
            mine += scene.last_update().step == update.step ? 0 : 1;
            scene.tree_statistics();
            different += mine;
        });
        ASSERT_EQ(different, 0) << pose;
    }
    EXPECT_GT(pending, 0);
    EXPECT_GT(swaps, 0);
}

TEST(Threads, AreToldThatAnotherOneChangesTheScene) {
    UserMesh mesh(torus(50, 40));
    const UserMesh second(icosphere(1));
    Scene scene = Scene::build(mesh.view(), Device::cpu(), {.update = morphray::Rebuild{}});
    const std::pair<std::string, std::function<void()>> changes[] = {
        {"update", [&] { scene.update(); }},
        {"part", [&] { scene.update(0, 1, 2); }},
        {"attach", [&] { scene.detach(scene.attach(second.view())); }},
        {"detach", [&] { scene.detach(7); }}};
    for (const auto& change : changes) {
        const std::string& what = change.first;
        std::atomic<int> busy = 0;
        std::atomic<int> wrong = 0;
        std::atomic<bool> is_over = false;
        const auto note = [&](const auto& call) {
            const std::string error = error_of(call);
            busy += error == "busy" ? 1 : 0;
            const bool is_expected = error == "none" || error == "busy";
            wrong += is_expected || (error == "bad_argument" && what == "detach") ? 0 : 1;
        };
        run_together({[&] {
                          for (int i = 0; i < 2000 && busy == 0; ++i) note([&] { scene.update(); });
                          is_over = true;
                      },
                      [&] {
                          while (!is_over && busy == 0) note(change.second);
                      }});
        EXPECT_GT(busy, 0) << what;
        EXPECT_EQ(wrong, 0) << what;
        EXPECT_EQ(error_of([&] { scene.update(); }), "none") << what;
    }
}

/// Every question of a device without a tree, where each takes long.
TEST(Threads, EndTheQuestionsOfOthers) {
    const UserMesh mesh(torus(30, 20));
    const Scene scene = Scene::build(mesh.view(), Device::brute_force());
    const std::vector<morphray::Ray> rays(1 << 16, {.org = {9, 8, 7}, .dir = {-9, -8, -7}});
    const std::vector<morphray::Vec3> points(rays.size(), {0.5f, 0.25f, 0.125f});
    CancelledCalls all(scene, rays, points);
    for (const auto& question : all.calls) {
        std::atomic<bool> cancel = false;
        all.flag = &cancel;
        std::string error;
        run_together({[&] { cancel = true; },
                      [&] {
                          bool was_set = false;
                          do {
                              was_set = cancel;
                              error = error_of(question.second);
                          } while (error == "none" && !was_set);
                      }});
        EXPECT_EQ(error, "cancelled") << question.first;
    }
}

}  // namespace
}  // namespace mray::test
