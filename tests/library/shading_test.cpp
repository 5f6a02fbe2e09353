// Images with several samples a pixel, lit, textured or in false colours.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <thread>
#include <utility>
#include <vector>

#include "tests/library/scenes.h"

namespace mray::test {
namespace {

using morphray::Device;
using morphray::Image;
using morphray::Scene;
using morphray::Shading;
using morphray::View;

constexpr Shading kShadings[] = {Shading::plain, Shading::lit,   Shading::normal, Shading::depth,
                                 Shading::prim,  Shading::steps, Shading::sah};

morphray::MeshView smooth_view(const UserMesh& mesh) {
    morphray::MeshView view = mesh.view();
    view.appearance.smooth = mesh.triangles;
    return view;
}

View view_of(Shading shading, std::uint32_t samples) {
    return {.width = 45, .height = 31, .shading = shading, .samples = samples, .ao_count = 3};
}

TEST(Shading, IsTheSameOnEveryDeviceAndForAnyTree) {
    UserMesh mesh(torus(30, 20));
    Scene scene = Scene::build(smooth_view(mesh));
    const Scene brute = scene.on(Device::brute_force());
    const Scene scalar = scene.on(Device::cpu({.threads = 1, .simd = "off"}));
    for (const Shading shading : kShadings) {
        for (const std::uint32_t samples : {1u, 4u, 16u}) {
            const View view = view_of(shading, samples);
            const Image image = scene.render(view);
            for (const Scene* other : {&brute, &scalar}) {
                const morphray::Comparison same = morphray::compare(image, other->render(view));
                EXPECT_TRUE(same.equal()) << morphray::describe(same);
                EXPECT_EQ(same.compared, std::uint64_t{45} * 31 * samples);
            }
        }
    }
}

TEST(Shading, FollowsTheDeformation) {
    UserMesh mesh(torus(30, 20));
    const morphray::SceneOptions options{.bounds = morphray::Box{{-4, -4, -4}, {4, 4, 4}},
                                         .update = morphray::Refit{}};
    Scene scene = Scene::build(smooth_view(mesh), Device::cpu(), options);
    const View view = view_of(Shading::lit, 4);
    const Image before = scene.render(view);
    for (morphray::Vec3& p : mesh.points) p.y *= 1.7f;
    scene.update();
    const Image after = scene.render(view);
    EXPECT_NE(after.image_hash, before.image_hash);
    const Scene fresh = Scene::build(smooth_view(mesh), Device::cpu(), options);
    EXPECT_EQ(after.image_hash, fresh.render(view).image_hash);
}

TEST(Shading, SmoothNormalsMakeMoreColoursThanTriangles) {
    const UserMesh mesh(torus(12, 8));
    const auto colours = [&](const morphray::MeshView& shaded, bool flat) {
        View view = view_of(Shading::normal, 1);
        view.flat = flat;
        const Image image = Scene::build(shaded).render(view);
        return std::set<std::uint32_t>(image.pixels.begin(), image.pixels.end());
    };
    const std::set<std::uint32_t> flat = colours(mesh.view(), false);
    EXPECT_EQ(colours(smooth_view(mesh), true), flat);
    EXPECT_GT(colours(smooth_view(mesh), false).size(), 3 * flat.size());
}

TEST(Shading, SeveralMeshesKeepTheirOwnNormals) {
    const UserMesh mesh(torus(30, 20));
    const UserMesh plane = [] {
        UserMesh square;
        square.points = {{-3, -3, -1}, {3, -3, -1}, {3, 3, -1}, {-3, 3, -1}};
        square.triangles = {0, 1, 2, 0, 2, 3};
        return square;
    }();
    const View view = view_of(Shading::normal, 1);
    const std::vector<morphray::MeshView> meshes = {plane.view(), smooth_view(mesh)};
    const std::vector<morphray::MeshView> reversed = {smooth_view(mesh), plane.view()};
    Scene scene = Scene::build(std::span(meshes));
    EXPECT_EQ(scene.render(view).pixels, Scene::build(std::span(reversed)).render(view).pixels);
    // The plane detached and attached again is geometry 0 once more.
    const std::uint64_t before = scene.render(view).image_hash;
    scene.detach(0);
    scene.update();
    EXPECT_NE(scene.render(view).image_hash, before);
    EXPECT_EQ(scene.attach(plane.view()), 0u);
    scene.update();
    EXPECT_EQ(scene.render(view).image_hash, before);
}

TEST(Shading, TracesTheRaysOfPlainImages) {
    UserMesh mesh(torus(30, 20));
    const Scene scene = Scene::build(smooth_view(mesh));
    const Scene brute = scene.on(Device::brute_force());
    const Scene scalar = scene.on(Device::cpu({.threads = 1, .simd = "off"}));
    for (const Scene* device : {&scene, &brute, &scalar}) {
        View lit = view_of(Shading::lit, 1);
        // Smooth surfaces have shadows of their own.
        lit.flat = true;
        View plain = view_of(Shading::plain, 1);
        const Image both = device->render(lit);
        lit.ao_count = 0;
        const Image shadowed = device->render(lit);
        plain.rays = morphray::Rays::shadow;
        const Image shadows = device->render(plain);
        EXPECT_EQ(shadowed.hits_hash, shadows.hits_hash);
        EXPECT_EQ(shadowed.ray_count, shadows.ray_count);
        plain.rays = morphray::Rays::ao;
        const Image sky = device->render(plain);
        for (std::size_t i = 0; i < sky.occlusion.size(); ++i)
            EXPECT_EQ(both.occlusion[i], shadows.occlusion[i] + sky.occlusion[i]) << i;
    }
}

TEST(Shading, RefusesWhatItCannotDo) {
    const UserMesh mesh(torus(6, 4));
    const Scene scene = Scene::build(mesh.view());
    const auto render = [&](const View& view) { return error_of([&] { scene.render(view); }); };
    for (const std::uint32_t samples : {0u, 2u, 3u, 9u, 100u})
        EXPECT_EQ(render(view_of(Shading::lit, samples)), "bad_argument");
    View large = view_of(Shading::plain, 64);
    large.width = 9000;
    EXPECT_EQ(render(large), "limit");
    large.width = 0xFFFFFFFFu;
    EXPECT_EQ(render(large), "limit");
    View none = view_of(Shading::lit, 1);
    none.ao_count = 0;
    EXPECT_EQ(render(none), "none");
    none.shading = Shading::plain;
    EXPECT_EQ(render(none), "bad_argument");
    EXPECT_EQ(render(view_of(static_cast<Shading>(17), 1)), "bad_argument");

    morphray::MeshView wrong = mesh.view();
    wrong.appearance.smooth = std::span(mesh.triangles).first(3);
    EXPECT_EQ(error_of([&] { Scene::build(wrong); }), "bad_argument");
    const std::vector<std::uint32_t> high(mesh.triangles.size(),
                                          static_cast<std::uint32_t>(mesh.triangles.size()));
    wrong.appearance.smooth = high;
    EXPECT_EQ(error_of([&] { Scene::build(wrong); }), "bad_argument");
}

TEST(Textures, ImageIsUprightFromItsTopRowDown) {
    UserMesh square;
    square.points = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
    square.triangles = {0, 1, 2, 0, 2, 3};
    const std::vector<float> texcoords = {0, 0, 1, 0, 1, 1, 0, 0, 1, 1, 0, 1};
    // Red and green above, blue and white below.
    const std::vector<std::uint32_t> texels = {0x0000FF, 0x00FF00, 0xFF0000, 0xFFFFFF};
    const std::vector<morphray::TextureView> textures = {
        {.texels = texels, .width = 2, .height = 2, .wrap = morphray::Wrap::clamp}};
    morphray::MeshView mesh = square.view();
    mesh.appearance.textures = textures;
    mesh.appearance.texcoords = texcoords;
    const Image image = Scene::build(mesh).render({.eye = morphray::Point{0, 0, 4},
                                                   .target = morphray::Point{0, 0, 0},
                                                   .fov = 2 * std::atan(0.25) * 180 / M_PI,
                                                   .light = morphray::Point{0, 0, 1000},
                                                   .width = 32,
                                                   .height = 32,
                                                   .shading = Shading::lit});
    const auto at = [&](std::size_t x, std::size_t y) { return image.pixels[32 * y + x]; };
    const auto is_on = [](std::uint32_t pixel, int k) { return (pixel >> (8 * k) & 0xFF) > 128; };
    for (int k = 0; k < 3; ++k) {
        EXPECT_EQ(is_on(at(4, 4), k), k == 0);
        EXPECT_EQ(is_on(at(27, 4), k), k == 1);
        EXPECT_EQ(is_on(at(4, 27), k), k == 2);
        EXPECT_TRUE(is_on(at(27, 27), k));
    }
}

}  // namespace
}  // namespace mray::test
