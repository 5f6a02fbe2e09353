// After any sequence of updates a scene answers as one that is newly built.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <set>
#include <span>

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

TEST(SceneUpdate, FollowsTheMeshUnderEachPolicy) {
    const UserMesh rest(torus(40, 20));
    const std::vector<morphray::UpdatePolicy> policies = {
        morphray::Refit{}, morphray::Rebuild{}, morphray::Every{3},
        morphray::Auto{.budget = 0.02, .deterministic = true}};
    const Step first_steps[] = {Step::refit, Step::rebuild, Step::refit, Step::refit};
    for (std::size_t p = 0; p < policies.size(); ++p) {
        UserMesh mesh = rest;
        const SceneOptions options{.bounds = kBounds, .update = policies[p]};
        Scene scene = Scene::build(mesh.view(), Device::cpu(), options);
        EXPECT_EQ(scene.last_update().step, Step::build);
        for (int pose = 1; pose < 7; ++pose) {
            sway(mesh, rest, pose);
            const morphray::Update update = scene.update();
            if (pose == 1) {
                EXPECT_EQ(update.step, first_steps[p]);
            }
            EXPECT_NE(update.reason, "");
            EXPECT_GE(update.milliseconds(), 0);
            const std::vector<morphray::Ray> rays = world_rays(mesh, 300, 10);
            expect_as_new(scene, {mesh.view()}, options, rays, std::to_string(pose));
        }
        if (p != 1) {
            EXPECT_EQ(scene.update().step, Step::keep);
        }
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

    // The member may be that of a base.
    struct Placed {
        morphray::Vec3 position;
    };
    struct Corner : Placed {
        float normal[3] = {5, 6, 7};
    };
    std::vector<Corner> corners(mesh.points.size());
    for (std::size_t i = 0; i < corners.size(); ++i) corners[i].position = mesh.points[i];
    const Scene of_base =
        Scene::build({morphray::strided(corners, &Corner::position), mesh.triangles}, Device::cpu(),
                     {.bounds = kBounds});
    expect_same_hits(hits_of(of_base, world_rays(mesh, 1000, 11)),
                     hits_of(scene, world_rays(mesh, 1000, 11)));

    // Doubles are rounded where they are read, also at the next update; indices may be of any kind.
    std::vector<std::array<double, 3>> doubles;
    for (const morphray::Vec3& p : rest.points) doubles.push_back({p.x, p.y, p.z});
    std::vector<std::array<std::int32_t, 3>> triangles;
    for (std::size_t i = 0; i < mesh.triangles.size(); i += 3) {
        triangles.push_back({static_cast<std::int32_t>(mesh.triangles[i]),
                             static_cast<std::int32_t>(mesh.triangles[i + 1]),
                             static_cast<std::int32_t>(mesh.triangles[i + 2])});
    }
    Scene of_doubles = Scene::build({morphray::packed(doubles), morphray::indices(triangles)},
                                    Device::cpu(), {.bounds = kBounds});
    for (std::size_t i = 0; i < doubles.size(); ++i)
        doubles[i] = {mesh.points[i].x * (1 + 1e-9), mesh.points[i].y, mesh.points[i].z};
    of_doubles.update();
    expect_same_hits(hits_of(of_doubles, world_rays(mesh, 1000, 11)),
                     hits_of(scene, world_rays(mesh, 1000, 11)));

    // At an odd address, too.
    std::vector<std::byte> bytes(13 * mesh.points.size() + 1);
    for (std::size_t i = 0; i < mesh.points.size(); ++i)
        std::memcpy(&bytes[1 + 13 * i], &mesh.points[i], 12);
    const Scene odd = Scene::build({{bytes.data() + 1, mesh.points.size(), 13}, mesh.triangles},
                                   Device::cpu(), {.bounds = kBounds});
    expect_same_hits(hits_of(odd, world_rays(mesh, 1000, 11)),
                     hits_of(scene, world_rays(mesh, 1000, 11)));
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
    const UserMesh rest(icosphere(3));
    UserMesh sphere = rest;
    UserMesh ring(torus(30, 20));
    UserMesh box(grid_box(6));
    const SceneOptions options{.bounds = kBounds};
    Scene scene = Scene::build(sphere.view(), Device::cpu(), options);
    EXPECT_EQ(scene.attach(ring.view(false)), 1u);
    EXPECT_EQ(scene.attach(box.view()), 2u);
    EXPECT_EQ(scene.triangle_count(), sphere.triangles.size() / 3);
    EXPECT_EQ(scene.update().step, Step::build);
    EXPECT_EQ(scene.triangle_count(),
              (sphere.triangles.size() + ring.triangles.size() + box.triangles.size()) / 3);
    const std::vector<morphray::Ray> rays = world_rays(ring, 2000, 13);
    expect_as_new(scene, {sphere.view(), ring.view(), box.view()}, options, rays, "three");

    sway(sphere, rest, 3);
    // The ring moves, but does not deform as far as the scene knows.
    const UserMesh old_ring = ring;
    for (morphray::Vec3& p : ring.points) p.x += 0.5f;
    scene.update();
    expect_as_new(scene, {sphere.view(), old_ring.view(), box.view()}, options, rays, "static");
    scene.update(1, 0, ring.points.size());
    expect_as_new(scene, {sphere.view(), ring.view(), box.view()}, options, rays, "told");

    scene.detach(0);
    scene.update();
    const std::vector<morphray::Hit> hits = hits_of(scene, rays);
    std::size_t of_box = 0;
    for (const morphray::Hit& hit : hits) {
        if (!hit) continue;
        ASSERT_TRUE(hit.geom_id == 1 || hit.geom_id == 2);
        ASSERT_LT(hit.prim_id, (hit.geom_id == 1 ? ring : box).triangles.size() / 3);
        of_box += hit.geom_id == 2 ? 1 : 0;
    }
    EXPECT_GT(of_box, 0u);
    EXPECT_LT(of_box, count_hits(hits));
    // The lowest geom_id is free again.
    EXPECT_EQ(scene.attach(sphere.view()), 0u);
    scene.detach(1);
    scene.detach(2);
    scene.update();
    expect_as_new(scene, {sphere.view()}, options, rays, "one");
    scene.detach(0);
    scene.update();
    EXPECT_EQ(scene.triangle_count(), 0u);
    EXPECT_EQ(count_hits(hits_of(scene, rays)), 0u);
}

TEST(SceneUpdate, TheLowestGeometryWinsAmongEqualHits) {
    const UserMesh mesh(icosphere(2));
    const std::vector<morphray::MeshView> twice = {mesh.view(), mesh.view()};
    const Scene scene = Scene::build(std::span<const morphray::MeshView>(twice));
    const std::vector<morphray::Hit> hits = hits_of(scene, world_rays(mesh, 1000, 14));
    EXPECT_GT(count_hits(hits), 300u);
    for (const morphray::Hit& hit : hits) EXPECT_EQ(hit.geom_id, hit ? 0u : morphray::kNoGeometry);
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

/// A mesh whose arrays another thread may write at any time: positions that the scene is not told
/// of are those of a scribbler, who writes NaN.
void scribble(UserMesh& mesh) {
    constexpr float bad = std::numeric_limits<float>::quiet_NaN();
    for (morphray::Vec3& p : mesh.points) p = {bad, bad, bad};
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
    scribble(ball);
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

TEST(SceneUpdate, PositionsThatAreNotFiniteAreLeftOut) {
    constexpr float bad = std::numeric_limits<float>::quiet_NaN();
    const UserMesh rest(torus(30, 20));
    UserMesh mesh = rest;
    const SceneOptions options{.bounds = kBounds};
    Scene scene = Scene::build(mesh.view(), Device::cpu(), options);
    const std::vector<morphray::Ray> rays = world_rays(rest, 1000, 17);
    const std::vector<morphray::Hit> before = hits_of(scene, rays);
    mesh.points[7].y = bad;
    mesh.points[8].x = std::numeric_limits<float>::infinity();
    scene.update();
    expect_as_new(scene, {mesh.view()}, options, rays, "some");
    for (morphray::Vec3& p : mesh.points) p.z = bad;
    scene.update();
    EXPECT_EQ(count_hits(hits_of(scene, rays)), 0u);
    EXPECT_GT(scene.bounds().lower[0], scene.bounds().upper[0]);
    mesh.points = rest.points;
    scene.update();
    expect_same_hits(hits_of(scene, rays), before, "finite again");
}

}  // namespace
}  // namespace mray::test
