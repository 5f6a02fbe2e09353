// After any sequence of updates, of meshes that come and go, and far from 0, a scene answers as one
// that is newly built.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "tests/library/scenes.h"

namespace mray::test {
namespace {

using morphray::Box;
using morphray::Device;
using morphray::Scene;
using morphray::SceneOptions;
using morphray::Step;

constexpr Box kBounds{{-3, -3, -3}, {3, 3, 3}};

void sway(UserMesh& mesh, const UserMesh& rest, int pose) {
    for (std::size_t i = 0; i < mesh.points.size(); ++i) {
        const float angle = 0.1f * static_cast<float>(pose) * rest.points[i].y;
        const morphray::Vec3 p = rest.points[i];
        mesh.points[i] = {p.x * std::cos(angle) - p.z * std::sin(angle), p.y,
                          p.x * std::sin(angle) + p.z * std::cos(angle)};
    }
}

TEST(SceneUpdate, ReadsTheCallersOwnVerticesInPlace) {
    struct Vertex {
        double weight = 0;
        std::array<float, 3> position = {};
        char colour[5] = {};
    };
    const UserMesh rest(icosphere(3));
    std::vector<Vertex> vertices(rest.points.size());
    const auto place = [&](const UserMesh& mesh) {
        for (std::size_t i = 0; i < vertices.size(); ++i)
            vertices[i].position = {mesh.points[i].x, mesh.points[i].y, mesh.points[i].z};
    };
    place(rest);
    Scene scene = Scene::build({morphray::strided(vertices, &Vertex::position), rest.triangles},
                               Device::cpu(), {.bounds = kBounds});
    UserMesh mesh = rest;
    sway(mesh, rest, 4);
    place(mesh);
    scene.update();
    expect_as_new(scene, {mesh.view()}, {.bounds = kBounds}, world_rays(mesh, 1000, 11), "strided");

    const std::vector<morphray::Ray> rays = world_rays(mesh, 1000, 11);
    const std::vector<morphray::Hit> expected = hits_of(scene, rays);
    const auto build_of = [](const morphray::MeshView& view) {
        return Scene::build(view, Device::cpu(), {.bounds = kBounds});
    };
    // The member may be that of a base.
    struct Placed {
        morphray::Vec3 position;
    };
    struct Corner : Placed {
        float normal[3] = {5, 6, 7};
    };
    std::vector<Corner> corners(mesh.points.size());
    for (std::size_t i = 0; i < corners.size(); ++i) corners[i].position = mesh.points[i];
    const Scene of_base = build_of({morphray::strided(corners, &Corner::position), mesh.triangles});
    expect_same_hits(hits_of(of_base, rays), expected);

    // Doubles are rounded where they are read, also at the next update; indices may be of any kind.
    std::vector<std::array<double, 3>> doubles;
    for (const morphray::Vec3& p : rest.points) doubles.push_back({p.x, p.y, p.z});
    std::vector<std::array<std::int32_t, 3>> triangles(mesh.triangles.size() / 3);
    std::memcpy(triangles.data(), mesh.triangles.data(), 4 * mesh.triangles.size());
    Scene of_doubles = build_of({morphray::packed(doubles), morphray::indices(triangles)});
    for (std::size_t i = 0; i < doubles.size(); ++i)
        doubles[i] = {mesh.points[i].x * (1 + 1e-9), mesh.points[i].y, mesh.points[i].z};
    of_doubles.update();
    expect_same_hits(hits_of(of_doubles, rays), expected);

    // At an odd address, too.
    std::vector<std::byte> bytes(13 * mesh.points.size() + 1);
    for (std::size_t i = 0; i < mesh.points.size(); ++i)
        std::memcpy(&bytes[1 + 13 * i], &mesh.points[i], 12);
    const Scene odd = build_of({{bytes.data() + 1, mesh.points.size(), 13}, mesh.triangles});
    expect_same_hits(hits_of(odd, rays), expected);
}

TEST(SceneUpdate, ReadsOnlyTheRangeThatIsNamed) {
    const UserMesh rest(torus(40, 20));
    UserMesh mesh = rest;
    Scene scene = Scene::build(mesh.view(), Device::cpu(), {.bounds = kBounds});
    const SceneOptions options{.bounds = kBounds};
    UserMesh moved = rest;
    sway(moved, rest, 5);
    // All positions move, but the scene is told of some only.
    const std::size_t first = 100;
    const std::size_t count = 333;
    mesh.points = moved.points;
    EXPECT_EQ(scene.update(0, first, count).step, Step::refit);
    UserMesh partly = rest;
    std::copy_n(moved.points.begin() + first, count, partly.points.begin() + first);
    expect_as_new(scene, {partly.view()}, options, world_rays(moved, 1000, 12), "part");
    EXPECT_EQ(scene.update(0, 0, 0).step, Step::keep);
    scene.update();
    expect_as_new(scene, {moved.view()}, options, world_rays(moved, 1000, 12), "all");
}

TEST(SceneUpdate, TakesAPoseInAnotherBuffer) {
    const UserMesh rest(torus(40, 20));
    const SceneOptions options{.bounds = kBounds};
    UserMesh buffers[2] = {rest, rest};
    const UserMesh box(grid_box(6));
    const std::vector<morphray::MeshView> meshes = {buffers[0].view(), box.view()};
    Scene scene = Scene::build(std::span<const morphray::MeshView>(meshes), Device::cpu(), options);
    for (int pose = 1; pose < 5; ++pose) {
        UserMesh& next = buffers[pose % 2];
        sway(next, rest, pose);
        EXPECT_EQ(scene.update(0, morphray::packed(next.points)).step, Step::refit);
        expect_as_new(scene, {next.view(), box.view()}, options, world_rays(next, 1000, 12),
                      "pose " + std::to_string(pose));
    }
    // The buffer of the last pose is the one that is borrowed.
    sway(buffers[0], rest, 9);
    scene.update();
    expect_as_new(scene, {buffers[0].view(), box.view()}, options, world_rays(rest, 1000, 12),
                  "borrowed");
    buffers[1].points.pop_back();
    EXPECT_EQ(error_of([&] { scene.update(0, morphray::packed(buffers[1].points)); }),
              "bad_argument");
    EXPECT_EQ(error_of([&] { scene.update(7, morphray::packed(buffers[0].points)); }),
              "bad_argument");
    EXPECT_EQ(error_of([&] {
                  scene.update(0, morphray::Positions{nullptr, buffers[0].points.size(), 12});
              }),
              "bad_argument");
    EXPECT_EQ(scene.update().step, Step::keep);
}

TEST(SceneUpdate, MeshesComeAndGo) {
    const UserMesh sphere(icosphere(3));
    UserMesh ring(torus(30, 20));
    const SceneOptions options{.bounds = kBounds};
    Scene scene = Scene::build(sphere.view(), Device::cpu(), options);
    EXPECT_EQ(scene.attach(ring.view(false)), 1u);
    EXPECT_EQ(scene.triangle_count(), sphere.triangles.size() / 3);
    EXPECT_NE(scene.update().step, Step::keep);
    EXPECT_EQ(scene.triangle_count(), (sphere.triangles.size() + ring.triangles.size()) / 3);
    // The ring moves, but does not deform as far as the scene knows.
    const std::vector<morphray::Ray> rays = world_rays(ring, 2000, 13);
    const UserMesh old_ring = ring;
    for (morphray::Vec3& p : ring.points) p.x += 0.5f;
    scene.update();
    expect_as_new(scene, {sphere.view(), old_ring.view()}, options, rays, "static");
    scene.update(1, 0, ring.points.size());
    expect_as_new(scene, {sphere.view(), ring.view()}, options, rays, "told");
    scene.detach(0);
    scene.update();
    const std::vector<morphray::Hit> hits = hits_of(scene, rays);
    EXPECT_GT(count_hits(hits), 0u);
    for (const morphray::Hit& hit : hits) ASSERT_TRUE(!hit || hit.geom_id == 1);
    // The lowest geom_id is free again.
    EXPECT_EQ(scene.attach(sphere.view()), 0u);
    scene.detach(0);
    scene.detach(1);
    scene.update();
    EXPECT_EQ(scene.triangle_count(), 0u);
    EXPECT_EQ(count_hits(hits_of(scene, rays)), 0u);
}

TEST(SceneUpdate, MeshesMayLeaveTheBoundsAndComeBack) {
    const UserMesh rest(torus(30, 20));
    UserMesh mesh = rest;
    const SceneOptions options{.bounds = Box{{-2, -2, -2}, {2, 2, 2}}};
    Scene scene = Scene::build(mesh.view(), Device::cpu(), options);
    const std::vector<morphray::Ray> rays = world_rays(mesh, 1000, 15);
    const std::vector<morphray::Hit> before = hits_of(scene, rays);
    for (const float scale : {1.5f, 100.0f, 3e6f, 1e30f, 1.0f}) {
        for (std::size_t i = 0; i < mesh.points.size(); ++i) {
            const morphray::Vec3 p = rest.points[i];
            mesh.points[i] = {scale * p.x, scale * p.y, p.z + (scale - 1)};
        }
        scene.update();
        const std::vector<morphray::Ray> at_pose = world_rays(mesh, 1000, 16);
        const std::vector<morphray::Hit> hits = hits_of(scene, at_pose);
        EXPECT_GT(count_hits(hits), 300u) << scale;
        expect_as_new(scene, {mesh.view()}, options, at_pose, std::to_string(scale));
    }
    expect_same_hits(hits_of(scene, rays), before, "back");
}

TEST(SceneUpdate, NewBoundsAreThoseOfABuild) {
    const UserMesh rest(torus(30, 20));
    const UserMesh still(torus(12, 8));
    const std::vector<SceneOptions> ways = {
        {.update = morphray::Refit{}},
        {.bounds = Box{{-2, -2, -2}, {2, 2, 2}}, .update = morphray::Refit{}},
        {.update = morphray::Auto{.deterministic = true}},
        {.update = morphray::Rebuild{}}};
    for (const SceneOptions& options : ways) {
        UserMesh mesh = rest;
        morphray::MeshView static_view = still.view();
        static_view.deforms = false;
        const std::vector<morphray::MeshView> meshes = {mesh.view(), static_view};
        Scene scene = Scene::build(meshes, Device::cpu(), options);
        // The last ones leave the bounds of those before, and have coordinates that are kept in
        // world space.
        for (const float scale : {0.3f, 1.7f, 1e-20f, 1e30f, 1.0f}) {
            for (std::size_t i = 0; i < mesh.points.size(); ++i) {
                const morphray::Vec3 p = rest.points[i];
                mesh.points[i] = {scale * p.x, p.y, p.z + scale};
            }
            if (scale == 1.7f) scene.update();
            const Step step = scene.update_with_new_bounds().step;
            if (std::holds_alternative<morphray::Refit>(options.update)) {
                EXPECT_TRUE(step == Step::refit || step == Step::keep) << scale;
            }
            const std::vector<morphray::Ray> rays = world_rays(mesh, 1000, 17);
            expect_as_new(scene, meshes, {}, rays, std::to_string(scale));
        }
        const UserMesh other(torus(9, 7));
        scene.attach(other.view());
        scene.update_with_new_bounds();
        expect_as_new(scene, {mesh.view(), static_view, other.view()}, {},
                      world_rays(mesh, 500, 18), "attached");
    }
}

TEST(SceneUpdate, ReadsNoMeshThatDoesNotDeform) {
    const UserMesh rest(torus(30, 20));
    const UserMesh rest_ball(icosphere(2));
    const UserMesh box(grid_box(4));
    const SceneOptions options{.bounds = Box{{-2, -2, -2}, {2, 2, 2}}};
    UserMesh mesh = rest;
    UserMesh ball = rest_ball;
    const std::vector<morphray::MeshView> views = {mesh.view(), ball.view(false)};
    Scene scene = Scene::build(std::span<const morphray::MeshView>(views), Device::cpu(), options);
    // Another thread may write to it.
    for (morphray::Vec3& p : ball.points) p.x = std::numeric_limits<float>::quiet_NaN();
    for (morphray::Vec3& p : mesh.points) p.x += 3000;
    scene.update();
    const std::vector<morphray::Ray> rays = world_rays(rest_ball, 1000, 22);
    expect_as_new(scene, {mesh.view(), rest_ball.view()}, options, rays, "outside");

    // Nor when other meshes come and go.
    scene.attach(box.view());
    scene.update();
    expect_as_new(scene, {mesh.view(), rest_ball.view(), box.view()}, options, rays, "attached");
    scene.detach(0);
    scene.update();
    const std::uint32_t geom_id = scene.attach(mesh.view());
    EXPECT_EQ(geom_id, 0u);
    scene.update();
    expect_as_new(scene, {mesh.view(), rest_ball.view(), box.view()}, options, rays, "again");

    // A mesh that takes the place of another one is read.
    scene.detach(1);
    EXPECT_EQ(scene.attach(rest_ball.view(false)), 1u);
    scene.update();
    expect_as_new(scene, {mesh.view(), rest_ball.view(), box.view()}, options, rays, "replaced");
}

TEST(SceneUpdate, ABodyAmongManyIsReplaced) {
    const std::vector<SceneOptions> ways = {
        {.bounds = kBounds, .update = morphray::Refit{}},
        {.bounds = kBounds, .update = morphray::Auto{.deterministic = true}},
        {.bounds = kBounds, .update = morphray::Rebuild{}}};
    const std::vector<UserMesh> shapes = {UserMesh(icosphere(1)), UserMesh(torus(9, 7)),
                                          UserMesh(grid_box(3))};
    for (const SceneOptions& options : ways) {
        Random random(19);
        const auto random_body = [&] {
            UserMesh body = shapes[random.below(3)];
            const vec3 place = random.point(0.8);
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
            if (step % 2 == 0)
                for (morphray::Vec3& p : bodies[random.below(60)]->points) p.x += 0.05f;
            EXPECT_EQ(scene.update().step, Step::build);
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
        const vec3 place = random.point(0.8);
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
    const SceneOptions options{.bounds = kBounds, .update = morphray::Refit{}};
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
        if (PaintedBody* const body = bodies[random.below(kBodies)].get()) {
            for (morphray::Vec3& p : body->mesh.points) p.y *= 1.1f;
            scene.update();
        }
        const Scene fresh = Scene::build(views, Device::cpu(), options);
        ASSERT_EQ(scene.render(view).pixels, fresh.render(view).pixels) << step;
        expect_as_new(scene, views, options, world_rays(UserMesh(torus(9, 7)), 200, 24), "hits");
    }
}

TEST(SceneOrigin, KeepsTheDigitsOfDoublesFarFromZero) {
    const UserMesh mesh(torus(40, 20));
    std::vector<std::array<double, 3>> doubles;
    for (const morphray::Vec3& p : mesh.points)
        doubles.push_back({p.x / 3.0 + 528980.85, p.y / 3.0 + 183526.1, p.z / 3.0 + 10});
    const morphray::Positions positions = morphray::packed(doubles);
    const morphray::Point origin = morphray::find_origin(positions);
    EXPECT_GT(morphray::rounding_error(positions, {}), 1e-3);
    EXPECT_LT(morphray::rounding_error(positions, origin), 1e-6);
    EXPECT_EQ(morphray::find_origin(morphray::packed(mesh.points)), morphray::Point{});
    EXPECT_EQ(morphray::find_origin({}), morphray::Point{});
    UserMesh near = mesh;
    const auto copy_to_near = [&] {
        for (std::size_t i = 0; i < doubles.size(); ++i) {
            const auto& p = doubles[i];
            near.points[i] = {static_cast<float>(p[0] - origin[0]),
                              static_cast<float>(p[1] - origin[1]),
                              static_cast<float>(p[2] - origin[2])};
        }
    };
    copy_to_near();
    const auto moved = [&](const morphray::Point& p, double sign) {
        return morphray::Point{p[0] + sign * origin[0], p[1] + sign * origin[1],
                               p[2] + sign * origin[2]};
    };
    const morphray::SceneOptions near_options{.bounds = kBounds};
    const morphray::SceneOptions options{
        .bounds = morphray::Box{moved(kBounds.lower, 1), moved(kBounds.upper, 1)},
        .origin = origin};
    Scene scene = Scene::build({positions, mesh.triangles}, Device::cpu(), options);
    EXPECT_EQ(scene.origin(), origin);
    EXPECT_EQ(scene.on(Device::brute_force()).origin(), origin);
    for (auto& p : doubles) p[1] += 0.1;
    scene.update();
    copy_to_near();
    const Scene expected = Scene::build(near.view(), Device::brute_force(), near_options);
    const std::vector<morphray::Ray> rays = world_rays(near, 1000, 65);
    expect_same_hits(hits_of(scene, rays), hits_of(expected, rays));
    EXPECT_EQ(scene.bounds().lower, moved(expected.bounds().lower, 1));
    EXPECT_EQ(scene.tree_boxes(0)[0].upper, moved(expected.tree_boxes(0)[0].upper, 1));
    EXPECT_EQ(scene.plus_origin({1, 2, 3}), moved({1, 2, 3}, 1));
    EXPECT_EQ(scene.less_origin(moved({1, 2, 3}, 1)), (morphray::Vec3{1, 2, 3}));
    const morphray::Point eye = {3, 4, 5};
    const morphray::View view{.eye = moved(eye, 1), .target = origin, .width = 64, .height = 64};
    const morphray::View near_view{
        .eye = eye, .target = morphray::Point{}, .width = 64, .height = 64};
    EXPECT_EQ(scene.render(view).hits_hash, expected.render(near_view).hits_hash);
    // Floats are of the caller's coordinates, too.
    const std::vector<morphray::Vec3> floats(3, {528981, 183526, 10});
    const std::vector<std::uint32_t> triangle = {0, 1, 2};
    const Scene of_floats =
        Scene::build({morphray::packed(floats), triangle}, Device::cpu(), {.origin = origin});
    EXPECT_EQ(of_floats.bounds().lower, (morphray::Point{528981, 183526, 10}));
    EXPECT_EQ(error_of([&] {
                  Scene::build(mesh.view(), Device::cpu(), {.origin = {0, std::nan(""), 0}});
              }),
              "bad_argument");
}

}  // namespace
}  // namespace mray::test
