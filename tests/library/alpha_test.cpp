// Holes that the alpha of textures makes.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/library/holed_scene.h"

namespace mray::test {
namespace {

using morphray::Device;
using morphray::Image;
using morphray::MeshView;
using morphray::Scene;
using morphray::Shading;
using morphray::View;

std::vector<View> views() {
    std::vector<View> views;
    for (const std::uint32_t samples : {1u, 4u}) {
        for (const std::uint32_t ao_count : {0u, 3u})
            views.push_back(view_of_leaves(samples, ao_count));
    }
    return views;
}

TEST(Holes, MeshThatIsAllHolesIsAsIfItWereNotThere) {
    const Ground ground;
    const Leaf leaf({kClear, kClear});
    const Scene with = build({ground.view(), leaf.view(), leaf.view()});
    const Scene without = build({ground.view()});
    for (const View& view : views()) {
        const Image image = with.render(view);
        const Image expected = without.render(view);
        EXPECT_EQ(image.pixels, expected.pixels);
        EXPECT_EQ(image.hits, expected.hits);
        EXPECT_EQ(image.occlusion, expected.occlusion);
        EXPECT_GT(image.ray_count, expected.ray_count);
    }
}

TEST(Holes, CountTheRaysThatPassThem) {
    const Ground ground;
    const Leaf clear({kClear, kClear}), solid({kSolid, kSolid});
    View view = view_of_leaves(1, 0);
    // Shadow rays go back the way of the camera's.
    view.light = view.eye;
    const Image image = build({ground.view(), clear.view()}).render(view);
    const Image before = build({ground.view(), solid.view()}).render(view);
    const Image behind = build({ground.view()}).render(view);
    std::uint64_t hit_count = 0, leaf_count = 0, changed_count = 0;
    for (std::size_t i = 0; i < before.hits.size(); ++i) {
        const bool is_leaf = before.hits[i].geom_id == 1;
        hit_count += before.hits[i] ? 1 : 0;
        leaf_count += is_leaf ? 1 : 0;
        changed_count += is_leaf && behind.hits[i] ? 1 : 0;
    }
    ASSERT_GT(changed_count, 0u);
    EXPECT_EQ(before.ray_count, before.hits.size() + hit_count);
    // A camera ray goes on behind the leaf; the surface there has a shadow ray, which goes on, too.
    EXPECT_EQ(image.ray_count, before.ray_count + leaf_count + 2 * changed_count);
}

TEST(Holes, HalfOfATextureIsHalfOfAMesh) {
    const Ground ground;
    const Leaf leaf({kClear, kSolid});
    Leaf half({kSolid, kSolid});
    half.points[0].x = half.points[3].x = 0;
    for (const View& view : views()) {
        const Image image = build({ground.view(), leaf.view()}).render(view);
        const Image expected = build({ground.view(), half.view()}).render(view);
        const Image whole = build({ground.view(), Leaf({kSolid, kSolid}).view()}).render(view);
        EXPECT_EQ(image.pixels, expected.pixels);
        EXPECT_EQ(image.occlusion, expected.occlusion);
        EXPECT_NE(image.pixels, whole.pixels);
        EXPECT_NE(image.occlusion, whole.occlusion) << "the light passes, too";
    }
}

TEST(Holes, AreTheSameOnEveryDeviceOfTheCpu) {
    const RandomLeaves leaves;
    const Scene scene = build(leaves.views());
    const std::vector<Scene> others = [&] {
        std::vector<Scene> all;
        all.push_back(scene.on(Device::brute_force()));
        std::vector<std::string> targets = morphray::simd_targets();
        targets.push_back("off");
        for (const std::string& simd : targets)
            all.push_back(scene.on(Device::cpu({.threads = 1, .simd = simd})));
        return all;
    }();
    for (const View& view : views()) {
        const Image image = scene.render(view);
        for (const Scene& other : others)
            EXPECT_TRUE(morphray::compare(image, other.render(view)).equal());
    }
}

TEST(Holes, ConcernLitImagesAlone) {
    const Ground ground;
    const Leaf leaf({kClear, kClear}), solid({kSolid, kSolid});
    const Scene scene = build({ground.view(), leaf.view()});
    const Scene expected = build({ground.view(), solid.view()});
    for (const Shading shading : {Shading::plain, Shading::normal, Shading::depth, Shading::prim}) {
        View view = view_of_leaves(1, 1);
        view.shading = shading;
        EXPECT_EQ(scene.render(view).pixels, expected.render(view).pixels);
    }
    const morphray::Ray down = {.org = {0.25f, 0.25f, 2}, .dir = {0, 0, -1}};
    EXPECT_EQ(scene.intersect(down).geom_id, 1u);
}

}  // namespace
}  // namespace mray::test
