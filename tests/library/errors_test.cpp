// Bad input gets an error with a code and a line, and changes nothing.
#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "tests/library/scenes.h"

namespace mray::test {
namespace {

using morphray::Device;
using morphray::MeshView;
using morphray::Scene;

TEST(LibraryErrors, NameTheTriangleOfABadIndex) {
    UserMesh mesh(icosphere(1));
    mesh.triangles[3 * 17 + 1] = 5000;
    try {
        Scene::build(mesh.view());
        FAIL();
    } catch (const morphray::Error& error) {
        EXPECT_EQ(error.code(), morphray::ErrorCode::bad_input);
        EXPECT_STREQ(error.what(), "triangle 17 has vertex 5000, but there are 42 positions");
    }
}

TEST(LibraryErrors, RefuseMeshesWhoseArraysDoNotFit) {
    const UserMesh mesh(icosphere(1));
    const std::uint32_t albedo[2] = {};
    const auto with = [&](const auto& change) {
        MeshView view = mesh.view();
        change(view);
        return error_of([&] { Scene::build(view); });
    };
    EXPECT_EQ(with([](MeshView& v) { v.triangles = v.triangles.first(7); }), "bad_input");
    EXPECT_EQ(with([](MeshView& v) { v.positions.data = nullptr; }), "bad_argument");
    EXPECT_EQ(with([](MeshView& v) { v.positions.stride = 8; }), "bad_argument");
    EXPECT_EQ(with([](MeshView& v) { v.positions.count = std::size_t{1} << 40; }), "limit");
    EXPECT_EQ(with([&](MeshView& v) { v.appearance.albedo = albedo; }), "bad_argument");
    EXPECT_EQ(with([](MeshView& v) { v.positions = {}; }), "bad_input");
}

TEST(LibraryErrors, RefuseUnsuitableOptions) {
    const UserMesh mesh(icosphere(1));
    const auto with = [&](const morphray::SceneOptions& options) {
        return error_of([&] { Scene::build(mesh.view(), Device::cpu(), options); });
    };
    EXPECT_EQ(with({.bounds = morphray::Box{{1, 0, 0}, {0, 1, 1}}}), "bad_argument");
    EXPECT_EQ(with({.bounds = morphray::Box{{0, 0, 0}, {0, NAN, 1}}}), "bad_argument");
    EXPECT_EQ(with({.update = morphray::Every{0}}), "bad_argument");
    EXPECT_EQ(with({.update = morphray::Every{2000000}}), "bad_argument");
    EXPECT_EQ(with({.update = morphray::Auto{.budget_ms = -1}}), "bad_argument");
    EXPECT_EQ(with({.update = morphray::Auto{.budget = NAN}}), "bad_argument");
    EXPECT_EQ(with({}), "none");
    EXPECT_EQ(error_of([] { Device::cpu({.threads = -1}); }), "bad_argument");
    EXPECT_EQ(error_of([] { Device::cpu({.simd = "mmx"}); }), "bad_argument");
}

TEST(LibraryErrors, RefuseSpansAndRangesThatDoNotFit) {
    const UserMesh mesh(icosphere(1));
    Scene scene = Scene::build(mesh.view());
    const std::vector<morphray::Ray> rays(3);
    std::vector<morphray::Hit> hits(2);
    std::vector<std::uint8_t> occluded(4);
    EXPECT_EQ(error_of([&] {
                  scene.intersect(std::span<const morphray::Ray>(rays),
                                  std::span<morphray::Hit>(hits));
              }),
              "bad_argument");
    EXPECT_EQ(error_of([&] { scene.occluded(rays, std::span<std::uint8_t>(occluded)); }),
              "bad_argument");
    const std::size_t count = mesh.points.size();
    EXPECT_EQ(error_of([&] { scene.update(0, 0, count + 1); }), "bad_argument");
    EXPECT_EQ(error_of([&] { scene.update(0, count + 1, 0); }), "bad_argument");
    EXPECT_EQ(error_of([&] { scene.update(0, 1, ~std::size_t{0}); }), "bad_argument");
    EXPECT_EQ(error_of([&] { scene.update(1, 0, 1); }), "bad_argument");
    EXPECT_EQ(error_of([&] { scene.detach(1); }), "bad_argument");
    EXPECT_EQ(scene.attach(mesh.view()), 1u);
    EXPECT_EQ(error_of([&] { scene.update(0, 0, 1); }), "bad_argument");
    scene.detach(1);
    EXPECT_EQ(error_of([&] { scene.detach(1); }), "bad_argument");
    // None of this has changed anything.
    scene.update();
    EXPECT_EQ(scene.update(0, 0, count).step, morphray::Step::keep);
}

TEST(LibraryErrors, RefuseImpossibleViews) {
    const UserMesh mesh(icosphere(1));
    const Scene scene = Scene::build(mesh.view());
    const auto with = [&](const morphray::View& view) {
        return error_of([&] { scene.render(view); });
    };
    EXPECT_EQ(with({.width = 0}), "bad_argument");
    EXPECT_EQ(with({.width = 70000, .height = 1}), "limit");
    EXPECT_EQ(with({.rays = morphray::Rays::ao, .ao_count = 0}), "bad_argument");
    EXPECT_EQ(with({.eye = morphray::Point{0, 0, 0}, .target = morphray::Point{0, 0, 0}}),
              "bad_input");
    EXPECT_EQ(with({.fov = 180}), "bad_input");
    EXPECT_EQ(with({.fov = NAN}), "bad_input");
    EXPECT_EQ(with({.up = {0, NAN, 0}}), "bad_input");
    EXPECT_EQ(with({.light = morphray::Point{NAN, 0, 0}}), "bad_input");
    EXPECT_EQ(with({.rays = morphray::Rays::ao, .ao_distance = NAN}), "bad_input");
    EXPECT_EQ(with({.rays = static_cast<morphray::Rays>(9)}), "bad_argument");
    EXPECT_EQ(error_of([] { morphray::write_png("image.png", {}); }), "bad_argument");
    morphray::Image image = scene.render({.width = 2, .height = 2});
    EXPECT_EQ(error_of([&] { morphray::write_png("/no/such/folder/image.png", image); }), "output");
    EXPECT_EQ(error_of([&] { morphray::compare(image, scene.render({.width = 4, .height = 1})); }),
              "bad_argument");
}

TEST(LibraryErrors, RefuseScenesThatWereMovedFrom) {
    const UserMesh mesh(icosphere(1));
    Scene scene = Scene::build(mesh.view());
    Scene other = std::move(scene);
    EXPECT_TRUE(other.intersect(morphray::Ray{{0, 0, 3}, 0, {0, 0, -1}}));
    EXPECT_EQ(error_of([&] { scene.update(); }), "bad_argument");
    EXPECT_EQ(error_of([&] { scene.intersect(morphray::Ray{}); }), "bad_argument");
    EXPECT_EQ(error_of([&] { scene.render({}); }), "bad_argument");
    EXPECT_EQ(error_of([&] { scene.device(); }), "bad_argument");
    scene = std::move(other);
    EXPECT_EQ(error_of([&] { scene.update(); }), "none");
}

}  // namespace
}  // namespace mray::test
