// Meshes that come and go among many.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <span>
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
            // A body may move in the update that others come and go with.
            if (step % 2 == 0) {
                for (morphray::Vec3& p : bodies[random.below(60)]->points) p.x += 0.05f;
            }
            EXPECT_EQ(scene.update().step, keeps ? Step::restructure : Step::build);
            const std::vector<morphray::Ray> rays = world_rays(shapes[0], 300, 20);
            expect_as_new(scene, views, options, rays, std::to_string(step));
            for (morphray::Vec3& p : bodies[random.below(60)]->points) p.y += 0.05f;
            scene.update();
            expect_as_new(scene, views, options, rays, "moved");
        }
    }
}

/// A body with colours, and perhaps with textures and smooth normals.
struct PaintedBody {
    UserMesh mesh;
    std::vector<std::uint32_t> albedo;
    std::vector<std::uint32_t> texels;
    std::vector<morphray::TextureView> textures;
    std::vector<float> texcoords;
    std::vector<std::uint32_t> texture_ids;
    bool is_smooth = false;

    explicit PaintedBody(Random& random) : is_smooth(random.below(2) == 0) {
        const std::uint32_t size = 3 + random.below(5);
        mesh = UserMesh(random.below(2) == 0 ? grid_box(size) : torus(size, 4));
        const mray::vec3 place = random.point(0.8);
        for (morphray::Vec3& p : mesh.points)
            p = {0.4f * p.x + place.x, 0.4f * p.y + place.y, 0.4f * p.z + place.z};
        const auto colour = [&] { return static_cast<std::uint32_t>(random.bits()) & 0xFFFFFFu; };
        const std::size_t count = mesh.triangles.size() / 3;
        for (std::size_t i = 0; i < count; ++i) albedo.push_back(colour());
        const std::uint32_t textured = random.below(3);
        if (textured == 0) return;
        for (int i = 0; i < 8; ++i) texels.push_back(colour());
        for (std::uint32_t i = 0; i < textured; ++i)
            textures.push_back({std::span(texels).subspan(4 * i, 4), 2, 2});
        for (std::size_t i = 0; i < 6 * count; ++i)
            texcoords.push_back(static_cast<float>(random.real(-1, 2)));
        for (std::size_t i = 0; i < count; ++i) {
            const std::uint32_t id = random.below(textured + 1);
            texture_ids.push_back(id == textured ? morphray::kNoTexture : id);
        }
    }

    morphray::MeshView view() const {
        morphray::MeshView view = mesh.view();
        view.appearance = {.albedo = albedo,
                           .textures = textures,
                           .texcoords = texcoords,
                           .texture_ids = texture_ids};
        if (is_smooth) view.appearance.smooth = mesh.triangles;
        return view;
    }
};

TEST(SceneUpdate, ColoursTexturesAndNormalsComeAndGoWithTheirMeshes) {
    Random random(23);
    constexpr std::uint32_t kBodies = 12;
    std::vector<std::unique_ptr<PaintedBody>> bodies(kBodies);
    // A mesh without triangles stands for one that is gone.
    std::vector<morphray::MeshView> views(kBodies);
    const SceneOptions options{.bounds = kRoom, .update = morphray::Refit{}};
    Scene scene = Scene::build(views, Device::cpu(), options);
    const morphray::View view{
        .width = 60, .height = 40, .shading = morphray::Shading::lit, .samples = 1, .ao_count = 2};
    for (int step = 0; step < 40; ++step) {
        std::vector<std::uint32_t> gone;
        for (std::uint32_t count = 1 + random.below(3); count > 0; --count) {
            const std::uint32_t id = random.below(kBodies);
            if (std::count(gone.begin(), gone.end(), id) > 0) continue;
            scene.detach(id);
            gone.push_back(id);
        }
        std::sort(gone.begin(), gone.end());
        for (const std::uint32_t id : gone) {
            bodies[id] = random.below(3) == 0 ? nullptr : std::make_unique<PaintedBody>(random);
            views[id] = bodies[id] ? bodies[id]->view() : morphray::MeshView{};
            ASSERT_EQ(scene.attach(views[id]), id);
        }
        scene.update();
        const Scene fresh = Scene::build(views, Device::cpu(), options);
        ASSERT_EQ(scene.render(view).pixels, fresh.render(view).pixels) << step;
        expect_as_new(scene, views, options, world_rays(UserMesh(torus(9, 7)), 200, 24), "hits");
    }
}

}  // namespace
}  // namespace mray::test
