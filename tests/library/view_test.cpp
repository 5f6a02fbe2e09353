// Images without hits, images that are cancelled, and the boxes of a tree: what a viewer needs.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <thread>

#include "tests/library/scenes.h"

namespace mray::test {
namespace {

using morphray::Box;
using morphray::Device;
using morphray::Image;
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

TEST(View, DoesNotShowWhatAnImageBeforeItHad) {
    const UserMesh mesh(torus(30, 20));
    const Scene scene = Scene::build(mesh.view());
    View near{.width = 64, .height = 48, .shading = Shading::lit, .hits = false};
    View far = near;
    far.eye = morphray::Point{30, 20, 40};
    near.ao_count = far.ao_count = 0;
    const auto alone = [&](View view) {
        view.hits = true;
        return Scene::build(mesh.view()).render(view);
    };
    const Image expected_near = alone(near);
    const Image expected_far = alone(far);
    for (int i = 0; i < 3; ++i) {
        for (const std::uint32_t width : {64u, 63u, 64u})
            scene.render({.width = width, .hits = false});
        EXPECT_EQ(scene.render(near).pixels, expected_near.pixels);
        const Image image = scene.render(far);
        EXPECT_EQ(image.pixels, expected_far.pixels);
        EXPECT_EQ(image.ray_count, expected_far.ray_count);
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

TEST(View, IsCancelledByAnotherThread) {
    const UserMesh mesh(torus(100, 80));
    const Scene scene = Scene::build(mesh.view());
    std::atomic<bool> cancel = false;
    // Takes minutes if nothing ends it.
    const View view{.width = 8000,
                    .height = 8000,
                    .rays = morphray::Rays::ao,
                    .ao_count = 256,
                    .hits = false,
                    .cancel = &cancel};
    std::thread other([&] { cancel = true; });
    EXPECT_EQ(error_of([&] { scene.render(view); }), "cancelled");
    other.join();
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

TEST(TreeBoxes, OfNothingAreNone) {
    const UserMesh mesh;
    EXPECT_TRUE(Scene::build(mesh.view()).tree_boxes(0).empty());
}

}  // namespace
}  // namespace mray::test
