// Images without hits, images that are cancelled, and the boxes of a tree: what a viewer needs.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <thread>
#include <vector>

#include "tests/library/scenes.h"

namespace mray::test {
namespace {

using morphray::Box;
using morphray::Device;
using morphray::Hit;
using morphray::Image;
using morphray::Ray;
using morphray::Scene;
using morphray::Shading;
using morphray::View;

TEST(View, WithoutHitsHasTheSamePixels) {
    const UserMesh mesh(torus(30, 20));
    const Scene scene = Scene::build(mesh.view());
    for (const Shading shading : {Shading::plain, Shading::lit, Shading::prim, Shading::steps}) {
        View view{.width = 45, .height = 31, .shading = shading, .samples = 4};
        const Image whole = scene.render(view);
        view.hits = false;
        const Image pixels = scene.render(view);
        EXPECT_EQ(pixels.pixels, whole.pixels);
        EXPECT_EQ(pixels.ray_count, whole.ray_count);
        EXPECT_EQ(pixels.width, 45u);
        EXPECT_EQ(pixels.height, 31u);
        EXPECT_TRUE(pixels.hits.empty());
        EXPECT_TRUE(pixels.occlusion.empty());
        EXPECT_EQ(pixels.image_hash, whole.image_hash);
        EXPECT_EQ(pixels.hits_hash, 0u);
    }
}

TEST(View, ThatIsCancelledThrowsAndTheNextIsWhole) {
    const UserMesh mesh(torus(30, 20));
    const Scene scene = Scene::build(mesh.view());
    std::atomic<bool> cancel = true;
    View view{.width = 64, .height = 64, .shading = Shading::lit};
    const Image expected = scene.render(view);
    view.cancel = &cancel;
    EXPECT_EQ(error_of([&] { scene.render(view); }), "cancelled");
    view.shading = Shading::plain;
    EXPECT_EQ(error_of([&] { scene.render(view); }), "cancelled");
    view.shading = Shading::lit;
    cancel = false;
    EXPECT_EQ(scene.render(view).pixels, expected.pixels);
}

TEST(View, OfAnySizeSamplesAndShadingIsCancelledBeforeItIsDone) {
    const UserMesh mesh(torus(100, 80));
    const Scene scene = Scene::build(mesh.view());
    // Each takes minutes if nothing ends it.
    for (const Device& device : {Device::cpu(), Device::brute_force()}) {
        const Scene on_device = scene.on(device);
        for (View view : {View{.rays = morphray::Rays::ao}, View{.shading = Shading::lit},
                          View{.shading = Shading::lit, .samples = 16}}) {
            view.width = view.height = view.samples == 1 ? 4096 : 1024;
            view.ao_count = 256;
            std::atomic<bool> cancel = false;
            view.cancel = &cancel;
            std::thread other([&] {
                std::this_thread::sleep_for(std::chrono::milliseconds(50));
                cancel = true;
            });
            EXPECT_EQ(error_of([&] { on_device.render(view); }), "cancelled");
            other.join();
        }
    }
}

TEST(SceneBuild, IsCancelled) {
    UserMesh mesh(torus(100, 80));
    std::atomic<bool> cancel = true;
    const morphray::SceneOptions options{.update = morphray::Rebuild{}, .cancel = &cancel};
    EXPECT_EQ(error_of([&] { Scene::build(mesh.view(), Device::cpu(), options); }), "cancelled");
    cancel = false;
    Scene scene = Scene::build(mesh.view(), Device::cpu(), options);
    EXPECT_EQ(scene.tree_statistics().hash,
              Scene::build(mesh.view(), Device::cpu()).tree_statistics().hash);
    cancel = true;
    mesh.points[0].x += 0.1f;
    EXPECT_EQ(error_of([&] { scene.update(); }), "cancelled");
    // It is of no use any more.
    cancel = false;
    EXPECT_EQ(error_of([&] { scene.update(); }), "cancelled");
    EXPECT_EQ(error_of([&] { scene.render({.width = 8, .height = 8}); }), "cancelled");
    const Ray ray{.org = {0, 0, 5}, .dir = {0, 0, -1}};
    EXPECT_EQ(error_of([&] { scene.intersect(ray); }), "cancelled");
    EXPECT_EQ(error_of([&] { scene.intersect(ray, Hit{.t = 1, .prim_id = 0, .geom_id = 0}); }),
              "cancelled");
    EXPECT_EQ(error_of([&] { scene.intersect_all({&ray, 1}); }), "cancelled");
    EXPECT_EQ(error_of([&] { scene.occluded(ray); }), "cancelled");
    EXPECT_EQ(error_of([&] { scene.tree_statistics(); }), "cancelled");
    EXPECT_EQ(error_of([&] { scene.tree_boxes(0); }), "cancelled");
    EXPECT_EQ(error_of([&] { scene.update_with_new_bounds(); }), "cancelled");
}

TEST(TreeBoxes, CoverTheSceneAtEachDepth) {
    const UserMesh mesh(torus(60, 40));
    const Scene scene = Scene::build(mesh.view());
    const Box bounds = scene.bounds();
    const std::uint32_t depth = scene.tree_statistics().depth;
    ASSERT_GE(depth, 2u);
    ASSERT_EQ(scene.tree_boxes(0).size(), 1u);
    EXPECT_GT(scene.tree_boxes(1).size(), 1u);
    EXPECT_LE(scene.tree_boxes(1).size(), 16u);
    for (std::uint32_t i = 0; i < 2; ++i) {
        Box all = scene.tree_boxes(i).front();
        for (const Box& box : scene.tree_boxes(i)) {
            for (std::size_t k = 0; k < 3; ++k) {
                EXPECT_LE(box.lower[k], box.upper[k]);
                all.lower[k] = std::min(all.lower[k], box.lower[k]);
                all.upper[k] = std::max(all.upper[k], box.upper[k]);
            }
        }
        // Boxes of leaves have a pad.
        for (std::size_t k = 0; k < 3; ++k) {
            EXPECT_LE(all.lower[k], bounds.lower[k]);
            EXPECT_GE(all.upper[k], bounds.upper[k]);
        }
    }
    EXPECT_TRUE(scene.tree_boxes(depth + 1).empty());
    EXPECT_TRUE(scene.tree_boxes(0xFFFFFFFFu).empty());
}

}  // namespace
}  // namespace mray::test
