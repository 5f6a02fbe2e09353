// Scenes on a Vulkan device answer as those on the CPU.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <optional>

#include "tests/library/answers.h"
#include "tests/library/holed_scene.h"
#include "tests/library/image_stacks.h"
#include "tests/support/run_together.h"

namespace mray::test {
namespace {

using morphray::Device;
using morphray::Scene;

const Device& vulkan() {
    static const Device device = Device::vulkan();
    return device;
}

void grow(UserMesh& mesh, float by) {
    for (morphray::Vec3& p : mesh.points) p = {p.x * by, p.y, p.z / by};
}

void expect_same_image(const Scene& scene, const Scene& twin, const morphray::View& view) {
    const morphray::Comparison same = morphray::compare(scene.render(view), twin.render(view));
    EXPECT_TRUE(same.equal()) << morphray::describe(same);
}

TEST(LibraryOnVulkan, AnswersAsTheCpu) {
    UserMesh mesh(torus(40, 24));
    const morphray::SceneOptions options{.bounds = morphray::Box{{-4, -4, -4}, {4, 4, 4}}};
    Scene scene = Scene::build(mesh.view(), vulkan(), options);
    EXPECT_EQ(scene.device().name(), "vulkan");
    Scene twin = scene.on(Device::cpu());
    const std::atomic<bool> cancel = false;
    for (int pose = 0; pose < 3; ++pose) {
        for (const std::size_t count : {3000, 50'000}) {
            const std::vector<morphray::Ray> rays = world_rays(mesh, count, 30);
            for (const morphray::QueryOptions& how :
                 {morphray::QueryOptions{},
                  {.coherence = morphray::Coherence::sort(), .cancel = &cancel}}) {
                std::vector<morphray::Hit> hits(count);
                scene.intersect(rays, hits, how);
                expect_same_hits(hits, hits_of(twin, rays));
                EXPECT_GT(count_hits(hits), count / 3);
                std::vector<std::uint8_t> dark(count), dark_on_cpu(count);
                scene.occluded(rays, dark, how);
                twin.occluded(rays, dark_on_cpu);
                EXPECT_EQ(dark, dark_on_cpu);
                std::vector<std::uint64_t> counts(count), counts_on_cpu(count);
                scene.count(rays, counts, morphray::Crossing::once, how);
                twin.count(rays, counts_on_cpu);
                EXPECT_EQ(counts, counts_on_cpu);
            }
            EXPECT_EQ(scene.intersect(rays[5]), twin.intersect(rays[5]));
            EXPECT_EQ(scene.occluded(rays[5]), twin.occluded(rays[5]));
        }
        expect_same_image(scene, twin, {.width = 64, .height = 48, .rays = morphray::Rays::shadow});
        EXPECT_EQ(scene.tree_statistics().hash, twin.tree_statistics().hash);
        grow(mesh, 1.3f);
        EXPECT_EQ(scene.update().step, morphray::Step::refit);
        twin.update();
    }
    scene.render({.width = 8, .height = 8});
    EXPECT_GT(scene.last_update().refit_ms, 0);
}

TEST(LibraryOnVulkan, StacksHaveTheBitsOfSingleImages) {
    UserMesh mesh(torus(40, 24));
    Scene scene = Scene::build(mesh.view(), vulkan());
    expect_stack_of_images(scene, mixed_views(3, 64, 64));
    grow(mesh, 1.1f);
    scene.update();
    expect_stack_of_images(scene, mixed_views(4, 45, 31));
    // Views of more than a submission, alone and together.
    expect_stack_of_images(scene, mixed_views(2, 700, 520));
    const std::vector<morphray::View> views = mixed_views(70, 70, 60);
    std::vector<float> depths(70 * 70 * 60), expected(depths.size());
    morphray::ImageStack stack{.depth = depths};
    scene.render(views, stack);
    stack = {.depth = expected};
    scene.on(Device::cpu()).render(views, stack);
    EXPECT_EQ(depths, expected);
}

TEST(LibraryOnVulkan, MeshesComeAndGoAsOnTheCpu) {
    std::vector<UserMesh> bodies(6, UserMesh(torus(12, 8)));
    std::vector<morphray::MeshView> views;
    for (std::size_t i = 0; i < bodies.size(); ++i) {
        for (morphray::Vec3& p : bodies[i].points) p.x += 1.5f * static_cast<float>(i);
        views.push_back(bodies[i].view());
    }
    const morphray::SceneOptions options{.bounds = morphray::Box{{-9, -9, -9}, {9, 9, 9}},
                                         .update = morphray::Refit{}};
    Scene scene = Scene::build(views, vulkan(), options);
    Scene twin = scene.on(Device::cpu());
    const std::vector<morphray::Ray> rays = world_rays(bodies[1], 1000, 32);
    UserMesh other(icosphere(1));
    for (int step = 0; step < 6; ++step) {
        // A mesh that stays moves in some of the updates, and in one without others.
        if (step % 3 != 0) grow(bodies[4], 1.1f);
        if (step % 3 != 2) {
            views[2] = step % 2 == 0 ? other.view() : bodies[2].view();
            for (Scene* const each : {&scene, &twin}) {
                each->detach(2);
                EXPECT_EQ(each->attach(views[2]), 2u);
            }
        }
        scene.update();
        twin.update();
        EXPECT_EQ(scene.tree_statistics().hash, twin.tree_statistics().hash) << step;
        expect_as_new(scene, views, options, rays, std::to_string(step));
    }
}

TEST(LibraryOnVulkan, BodiesFollowMatricesAsOnTheCpu) {
    std::vector<UserMesh> bodies(7, UserMesh(torus(44, 30)));
    bodies[1] = bodies[4] = UserMesh(icosphere(2));
    // A denormal, which devices may flush.
    bodies[5].points[3].x = 1e-40f;
    std::vector<morphray::MeshView> views;
    for (std::size_t i = 0; i < bodies.size(); ++i) views.push_back(bodies[i].view(i == 3));
    const morphray::SceneOptions options{.bounds = morphray::Box{{-9, -9, -9}, {9, 9, 9}},
                                         .update = morphray::Refit{}};
    Scene scene = Scene::build(views, vulkan(), options);
    Scene twin = scene.on(Device::cpu());
    const std::vector<morphray::Ray> rays = world_rays(bodies[0], 1000, 32);
    for (int step = 0; step < 12; ++step) {
        std::vector<morphray::MeshPose> poses;
        for (std::uint32_t id = 0; id < bodies.size(); ++id)
            if (id != 3 && (id + static_cast<std::uint32_t>(step)) % 4 != 0)
                poses.push_back({id, turned(id + step, step % 3 - 1, 0.5 * id - 1)});
        // Too small a shift, beyond the bounds, and beyond floats.
        if (step == 5) poses[0].transform.rows[0][3] = 1e-17;
        if (step == 7) poses[1].transform.rows[2][3] = 1e4;
        if (step == 9) poses[1].transform.rows[1][1] = 3e38;
        grow(bodies[3], 1.01f);
        if (step == 4) grow(bodies[0], 1.1f);
        for (Scene* const both : {&scene, &twin}) {
            both->update();
            both->update(poses);
            if (step == 4) both->update(0, 0, bodies[0].points.size());
            if (step != 9) continue;
            both->detach(2);
            EXPECT_EQ(both->attach(bodies[2].view(false)), 2u);
            both->update();
        }
        EXPECT_EQ(scene.tree_statistics().hash, twin.tree_statistics().hash) << step;
        expect_same_hits(hits_of(scene, rays), hits_of(twin, rays), std::to_string(step));
    }
}

TEST(LibraryOnVulkan, LetsLightThroughHolesAsTheCpu) {
    const RandomLeaves leaves;
    const Scene scene = build(leaves.views(), vulkan());
    const Scene twin = scene.on(Device::cpu());
    for (const std::uint32_t ao_count : {0u, 3u})
        expect_same_image(scene, twin, view_of_leaves(4, ao_count));
}

TEST(LibraryOnVulkan, AnswersQuestionsAsTheCpuAfterEachUpdate) {
    expect_same_answers_on({vulkan()});
}

TEST(LibraryOnVulkan, HasTheDocumentedDigest) {
    EXPECT_EQ(morphray::digest(vulkan()), morphray::kDigest);
}

TEST(LibraryOnVulkan, FindsVisibleHits) { expect_visible_hits_on(vulkan(), 20); }

TEST(LibraryOnVulkan, LeavesOutTriangles) { expect_excluded_on(vulkan(), 20); }

TEST(LibraryOnVulkan, LeavesOutTrianglesForPoints) { expect_filtered_points_on(vulkan(), 40); }

TEST(LibraryOnVulkan, QuestionsAreCancelledByAFlagThatIsTrueBefore) {
    expect_all_are_cancelled_on(vulkan());
}

TEST(LibraryOnVulkan, LitImagesAreThoseOfTheCpu) {
    UserMesh mesh(torus(40, 24));
    morphray::MeshView smooth = mesh.view();
    smooth.appearance.smooth = mesh.triangles;
    const Scene scene = Scene::build(smooth, vulkan());
    const Scene twin = scene.on(Device::cpu());
    // Without colours of the device first, then with them, then without again.
    for (const auto shading : {morphray::Shading::lit, morphray::Shading::plain,
                               morphray::Shading::prim, morphray::Shading::lit}) {
        for (const std::uint32_t ao_count : {0u, 3u}) {
            expect_same_image(scene, twin,
                              {.width = 70,
                               .height = 50,
                               .rays = morphray::Rays::shadow,
                               .shading = shading,
                               .ao_count = shading == morphray::Shading::lit ? ao_count : 3});
        }
    }
}

/// A deterministic policy counts rays, so a device's scene takes the steps of a scene on the CPU.
TEST(LibraryOnVulkan, DecidesByItsRaysAsTheCpu) {
    const UserMesh rest(random_soup(1000, 0.1, 8));
    UserMesh mesh = rest;
    const morphray::SceneOptions options{.bounds = morphray::Box{{-9, -9, -9}, {9, 9, 9}},
                                         .update = morphray::Auto{.deterministic = true}};
    Scene scene = Scene::build(mesh.view(), vulkan(), options);
    Scene twin = Scene::build(mesh.view(), Device::cpu(), options);
    int changed = 0;
    for (int pose = 0; pose < 20; ++pose) {
        const float way = 0.03f * static_cast<float>(pose);
        for (std::size_t i = 0; i < mesh.points.size(); ++i)
            mesh.points[i].x = rest.points[i].x + way * static_cast<float>(i / 3 * 7 % 11);
        const morphray::Step step = scene.update().step;
        ASSERT_EQ(step, twin.update().step) << pose;
        changed += step == morphray::Step::refit ? 0 : 1;
        for (const Scene* asked : {&scene, &twin}) hits_of(*asked, world_rays(mesh, 30000, 1));
    }
    EXPECT_GT(changed, 0);
}

TEST(LibraryOnVulkan, ScenesAndThreadsShareADevice) {
    const UserMesh first(icosphere(3));
    const UserMesh second(torus(20, 12));
    const Scene a = Scene::build(first.view(), vulkan());
    const std::vector<morphray::Ray> rays = world_rays(first, 1000, 32);
    const std::vector<morphray::Hit> of_a = hits_of(a, rays);
    for (int round = 0; round < 2; ++round) {
        const Scene b = Scene::build(second.view(), vulkan());
        const std::vector<morphray::Hit> of_b = hits_of(b, rays);
        std::atomic<int> different = 0;
        run_together(2, [&](std::size_t thread) {
            for (int k = 0; k < 4; ++k)
                different += hits_of(thread == 0 ? a : b, rays) != (thread == 0 ? of_a : of_b);
        });
        EXPECT_EQ(different, 0);
    }
}

TEST(LibraryOnVulkan, IsRefusedInAForkedChild) {
    const UserMesh mesh(icosphere(2));
    std::optional<Scene> scene = Scene::build(mesh.view(), vulkan());
    const morphray::Ray ray = world_rays(mesh, 1, 3).front();
    scene->intersect(ray);
    const pid_t child = ::fork();
    if (child == 0) {
        ::alarm(20);
        const std::string errors =
            error_of([&] { scene->intersect(ray); }) + error_of([&] { scene->update(); }) +
            error_of([&] { Scene::build(mesh.view(), vulkan()); }) +
            error_of([] { Device::vulkan(); }) + error_of([] { morphray::vulkan_devices(); });
        scene.reset();
        const Scene on_cpu = Scene::build(mesh.view());
        ::_exit(errors == "unavailableunavailableunavailableunavailableunavailable" &&
                        on_cpu.intersect(ray)
                    ? 0
                    : 1);
    }
    int status = -1;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    EXPECT_EQ(status, 0);
    EXPECT_TRUE(scene->intersect(ray));
}

}  // namespace
}  // namespace mray::test
