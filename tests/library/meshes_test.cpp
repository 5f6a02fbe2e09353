// Meshes that come and go among many.
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "tests/library/scenes.h"

namespace mray::test {
namespace {

using morphray::Device;
using morphray::Scene;
using morphray::SceneOptions;
using morphray::Step;

constexpr morphray::Box kRoom{{-3, -3, -3}, {3, 3, 3}};

TEST(SceneUpdate, ABodyAmongManyIsReplaced) {
    const std::vector<SceneOptions> ways = {
        {.bounds = kRoom, .update = morphray::Refit{}},
        {.bounds = kRoom, .update = morphray::Auto{.deterministic = true}},
        {.bounds = kRoom, .update = morphray::Rebuild{}}};
    const std::vector<UserMesh> shapes = {UserMesh(icosphere(1)), UserMesh(torus(9, 7)),
                                          UserMesh(grid_box(3))};
    for (const SceneOptions& options : ways) {
        mray::test::Random random(19);
        const auto random_body = [&] {
            UserMesh body = shapes[random.below(3)];
            const mray::vec3 place = random.point(0.8);
            for (morphray::Vec3& p : body.points)
                p = {0.1f * p.x + place.x, 0.1f * p.y + place.y, 0.1f * p.z + place.z};
            return body;
        };
        std::vector<std::unique_ptr<UserMesh>> bodies;
        std::vector<morphray::MeshView> views;
        for (int i = 0; i < 60; ++i) {
            bodies.push_back(std::make_unique<UserMesh>(random_body()));
            views.push_back(bodies.back()->view());
        }
        Scene scene = Scene::build(views, Device::cpu(), options);
        const bool keeps = !std::holds_alternative<morphray::Rebuild>(options.update);
        for (int step = 0; step < 12; ++step) {
            for (std::uint32_t count = 1 + random.below(3); count > 0; --count) {
                const std::uint32_t id = random.below(60);
                auto body = std::make_unique<UserMesh>(random_body());
                scene.detach(id);
                ASSERT_EQ(scene.attach(body->view()), id);
                bodies[id] = std::move(body);
                views[id] = bodies[id]->view();
            }
            for (morphray::Vec3& p : bodies[random.below(60)]->points) p.x += 0.05f;
            EXPECT_EQ(scene.update().step, keeps ? Step::restructure : Step::build);
            const std::vector<morphray::Ray> rays = world_rays(shapes[0], 300, 20);
            expect_as_new(scene, views, options, rays, std::to_string(step));
            for (morphray::Vec3& p : bodies[random.below(60)]->points) p.y += 0.05f;
            scene.update();
            expect_as_new(scene, views, options, rays, "moved");
        }
    }
}

}  // namespace
}  // namespace mray::test
