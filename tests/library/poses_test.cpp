// Meshes that follow matrices answer as those whose vertices the caller moves.
#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "tests/library/scenes.h"

namespace mray::test {
namespace {

using morphray::Device;
using morphray::MeshPose;
using morphray::Scene;
using morphray::Transform;

const morphray::SceneOptions kOptions{
    .bounds = morphray::Box{{-5, -5, -5}, {5, 5, 5}},
    .update = morphray::Auto{.budget = 0.02, .deterministic = true}};

/// A scene of three meshes, of which the second does not deform.
struct Bodies {
    std::vector<UserMesh> meshes = {UserMesh(torus(20, 12)), UserMesh(icosphere(3)),
                                    UserMesh(grid_box(6))};
    Scene scene;

    explicit Bodies(const Device& device = Device::cpu())
        : scene(Scene::build(views(), device, kOptions)) {}
    std::vector<morphray::MeshView> views() const {
        return {meshes[0].view(), meshes[1].view(false), meshes[2].view()};
    }
    /// Moves the vertices of a mesh, as a pose moves those of `rest`.
    morphray::Update follow(const UserMesh& rest, const MeshPose& pose) {
        move(pose.transform, rest, meshes[pose.geom_id]);
        return scene.update(pose.geom_id, 0, rest.points.size());
    }
};

void expect_as_twin(const Bodies& bodies, const Bodies& twin, const std::string& what) {
    const std::vector<morphray::Ray> rays = world_rays(twin.meshes[0], 500, 40);
    expect_same_hits(hits_of(bodies.scene, rays), hits_of(twin.scene, rays), what);
    // Both have as many rays to trace, so that their policies see equal frames.
    for (const Scene& scene : {std::cref(bodies.scene), std::cref(twin.scene)})
        expect_as_new(scene, twin.views(), kOptions, rays, what);
}

TEST(ScenePoses, AreThoseOfTheCallersLines) {
    for (const Device& device : {Device::cpu(), Device::brute_force()}) {
        Bodies bodies(device);
        Bodies twin(device);
        for (int step = 1; step < 12; ++step) {
            // One by one, then together; the last is a mirror. The third mesh deforms.
            const MeshPose pose{1, turned(step, step < 11 ? 0.7 : -1, 0.1 * step)};
            const morphray::Update update = bodies.scene.update(1, pose.transform);
            const morphray::Update expected = twin.follow(bodies.meshes[1], pose);
            EXPECT_EQ(update.step, expected.step);
            EXPECT_EQ(update.reason, expected.reason);
            EXPECT_EQ(bodies.scene.tree_statistics().hash, twin.scene.tree_statistics().hash);
            for (Bodies* const both : {&bodies, &twin})
                for (morphray::Vec3& p : both->meshes[2].points) p.z *= 1.02f;
            const std::vector<MeshPose> poses = {pose, {0, turned(-2 * step, 1, 0.3)}};
            bodies.scene.update();
            bodies.scene.update(poses);
            move(poses[1].transform, bodies.meshes[0], twin.meshes[0]);
            twin.scene.update();
            twin.scene.update();
            expect_as_twin(bodies, twin, std::to_string(step));
            EXPECT_EQ(bodies.scene.update(poses).step, twin.scene.update().step);
        }
        bodies.scene.update_with_new_bounds();
        twin.scene.update_with_new_bounds();
        EXPECT_EQ(bodies.scene.bounds(), twin.scene.bounds());
    }
}

TEST(ScenePoses, BodiesThatLeaveOnePlaceBeforeTheFirstTraceGetANewTree) {
    const UserMesh body(icosphere(3));
    Scene scene =
        Scene::build(std::vector<morphray::MeshView>(50, body.view()), Device::cpu(), kOptions);
    std::vector<MeshPose> poses;
    for (std::uint32_t i = 0; i < 50; ++i) poses.push_back({i, turned(i, 1, 0.1 * i - 2.5)});
    EXPECT_EQ(scene.update().step, morphray::Step::keep);
    EXPECT_EQ(scene.update(poses).step, morphray::Step::rebuild);
}

TEST(ScenePoses, StayUntilTheMeshGoes) {
    Bodies bodies;
    Bodies twin;
    const MeshPose pose{1, turned(1, 0.7, 2)};
    bodies.scene.update(1, pose.transform);
    UserMesh rest = bodies.meshes[1];
    twin.follow(rest, pose);
    // The caller's array is read when the caller says so.
    for (morphray::Vec3& p : bodies.meshes[1].points) p.x *= 1.5f;
    bodies.scene.update();
    expect_as_twin(bodies, twin, "update()");
    std::copy_n(bodies.meshes[1].points.begin() + 10, 50, rest.points.begin() + 10);
    bodies.scene.update(1, 10, 50);
    twin.follow(rest, pose);
    expect_as_twin(bodies, twin, "part of the rest positions");
    for (morphray::Vec3& p : rest.points) p = {p.y, p.z, p.x};
    bodies.scene.update(1, morphray::packed(rest.points));
    twin.follow(rest, pose);
    expect_as_twin(bodies, twin, "other rest positions");
    // A copy moves by itself.
    Scene copy = bodies.scene.on(Device::brute_force());
    copy.update(1, Transform{});
    expect_as_twin(bodies, twin, "copy");
    // Others come and go; then it goes.
    const std::vector<morphray::Ray> rays = world_rays(rest, 500, 41);
    bodies.scene.detach(0);
    bodies.scene.update();
    EXPECT_EQ(bodies.scene.attach(bodies.meshes[0].view()), 0u);
    bodies.scene.update();
    expect_as_new(bodies.scene, twin.views(), kOptions, rays, "others came");
    bodies.scene.detach(1);
    EXPECT_EQ(bodies.scene.attach(rest.view()), 1u);
    bodies.scene.update();
    twin.meshes[1] = rest;
    expect_as_new(bodies.scene, twin.views(), kOptions, rays, "new mesh");
    expect_as_new(copy, twin.views(), kOptions, rays, "identity");
}

TEST(ScenePoses, WhatIsRefusedChangesNothing) {
    Bodies bodies;
    const Transform pose = turned(2, 1, 1);
    bodies.scene.update(0, turned(1, 1, 0));
    const auto code_of = [&](const std::vector<MeshPose>& poses) {
        return error_of([&] { bodies.scene.update(poses); });
    };
    EXPECT_EQ(code_of({{0, pose}, {3, pose}}), "bad_argument");
    EXPECT_EQ(code_of({{0, pose}, {1, pose}, {0, pose}}), "bad_argument");
    for (const double bad : {std::numeric_limits<double>::quiet_NaN(), 1e39, -HUGE_VAL}) {
        for (const std::size_t column : {0, 2, 3}) {
            Transform other = pose;
            other.rows[1][column] = bad;
            EXPECT_EQ(code_of({{0, pose}, {1, other}}), "bad_argument");
        }
    }
    bodies.scene.attach(bodies.meshes[1].view());
    EXPECT_EQ(code_of({{0, pose}}), "bad_argument");
    bodies.scene.detach(3);
    bodies.scene.update();
    EXPECT_EQ(code_of({}), "none");
    EXPECT_EQ(bodies.scene.update(0, turned(1, 1, 0)).step, morphray::Step::keep);
}

TEST(ScenePoses, VerticesBeyondFloatsAreLeftOut) {
    Bodies bodies;
    Bodies twin;
    Transform far = turned(1, 1, 0);
    for (std::array<double, 4>& row : far.rows)
        for (double& number : row) number *= 3e38;
    const morphray::Update update = bodies.scene.update(0, far);
    ASSERT_EQ(update.left_out.size(), 1u);
    EXPECT_EQ(update.left_out[0].geom_id, 0u);
    EXPECT_GT(update.left_out[0].not_finite, 0u);
    EXPECT_GT(update.left_out[0].too_far, 0u);
    twin.follow(bodies.meshes[0], {0, far});
    expect_as_twin(bodies, twin, "far");
    EXPECT_TRUE(bodies.scene.update(0, Transform{}).left_out.empty());
    expect_as_twin(bodies, Bodies(), "back");
}

TEST(ScenePoses, RestPositionsAreNotMovedByTheOrigin) {
    const morphray::Point origin = {500'000, 4'000'000, 0};
    const UserMesh rest(torus(20, 12));
    std::vector<std::array<double, 3>> doubles;
    for (const morphray::Vec3& p : rest.points) doubles.push_back({p.x, p.y, p.z});
    const morphray::SceneOptions options{
        .bounds = morphray::Box{{499'990, 3'999'990, -10}, {500'010, 4'000'010, 10}},
        .origin = origin};
    Scene scene = Scene::build({morphray::packed(doubles), rest.triangles}, Device::cpu(), options);
    Transform pose = turned(1, 1, origin[0] + 0.123456789);
    pose.rows[1][3] += origin[1];
    scene.update(0, pose);
    UserMesh moved = rest;
    move(pose, rest, moved, origin);
    const morphray::SceneOptions at_zero{.bounds = morphray::Box{{-10, -10, -10}, {10, 10, 10}}};
    expect_as_new(scene, {moved.view()}, at_zero, world_rays(moved, 500, 43), "origin");
}

}  // namespace
}  // namespace mray::test
