// Many views in one call.
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>

#include "tests/library/image_stacks.h"

namespace mray::test {
namespace {

using morphray::Device;
using morphray::ImageStack;
using morphray::Pinhole;
using morphray::Scene;
using morphray::View;

/// A torus and a ball beside it.
Scene make_scene() {
    const UserMesh ring(torus(40, 24));
    UserMesh ball(icosphere(2));
    for (morphray::Vec3& p : ball.points) p = {0.4f * p.x, 0.4f * p.y, 0.4f * p.z + 1};
    const std::vector<morphray::MeshView> meshes = {ring.view(false), ball.view(false)};
    return Scene::build(meshes, Device::cpu(), {.bounds = morphray::Box{{-4, -4, -4}, {4, 4, 4}}});
}

TEST(Stack, HasTheBitsOfSingleImagesOnEveryDevice) {
    const Scene scene = make_scene();
    std::vector<Device> devices = {Device::brute_force(), Device::cpu({.threads = 3}),
                                   Device::cpu({.simd = "off"})};
    for (const std::string& simd : morphray::simd_targets())
        devices.push_back(Device::cpu({.threads = 1, .simd = simd}));
    for (const Device& device : devices) {
        const Scene copy = scene.on(device);
        expect_stack_of_images(copy, mixed_views(3, 64, 64));
        expect_stack_of_images(copy, mixed_views(2, 130, 70));
        expect_stack_of_images(copy, mixed_views(40, 9, 3));
    }
}

TEST(Stack, EachChannelAloneIsTheSame) {
    const Scene scene = make_scene();
    const std::vector<View> views = mixed_views(4, 50, 40);
    StackArrays all(views.size() * 50 * 40);
    ImageStack stack = all.stack();
    scene.render(views, stack);
    StackArrays alone(all.depth.size());
    const ImageStack room = alone.stack();
    for (const ImageStack& one :
         {ImageStack{.depth = room.depth}, ImageStack{.distance = room.distance},
          ImageStack{.geom_id = room.geom_id}, ImageStack{.prim_id = room.prim_id},
          ImageStack{.normal = room.normal}, ImageStack{.uv = room.uv},
          ImageStack{.shaded = room.shaded}}) {
        stack = one;
        scene.render(views, stack);
        EXPECT_EQ(stack.ray_count, all.depth.size());
    }
    EXPECT_TRUE(alone == all);
}

TEST(PinholeView, HasTheSamplesOfALargerImage) {
    const Scene scene = make_scene();
    View view = pinhole_view(0.5, 0.2, 4, 0.3, 40, 30);
    view.samples = 4;
    EXPECT_EQ(scene.render(view).hits, scene.render(pinhole_view(0.5, 0.2, 4, 0.3, 80, 60)).hits);
}

TEST(Stack, RefusesWhatItCannotDo) {
    const Scene scene = make_scene();
    StackArrays arrays(2 * 8 * 8);
    const auto render = [&](const std::vector<View>& views, ImageStack stack) {
        return error_of([&] { scene.render(views, stack); });
    };
    std::vector<View> views = mixed_views(2, 8, 8);
    EXPECT_EQ(render(views, arrays.stack()), "none");
    EXPECT_EQ(render(views, {}), "none");
    EXPECT_EQ(render({}, {}), "none");
    EXPECT_EQ(render({}, arrays.stack()), "bad_argument");
    EXPECT_EQ(render(mixed_views(3, 8, 8), arrays.stack()), "bad_argument");
    const auto refused = [&](auto change) {
        std::vector<View> changed = views;
        change(changed[0]);
        return render(changed, arrays.stack());
    };
    EXPECT_EQ(refused([](View& view) { view.width = 9; }), "bad_argument");
    EXPECT_EQ(refused([](View& view) { view.samples = 4; }), "bad_argument");
    EXPECT_EQ(refused([](View& view) { view.rays = morphray::Rays::ao; }), "bad_argument");
    EXPECT_EQ(refused([](View& view) { view.shading = morphray::Shading::lit; }), "bad_argument");
    const std::atomic<bool> cancel = true;
    EXPECT_EQ(refused([&](View& view) { view.cancel = &cancel; }), "cancelled");

    const auto refused_camera = [&](auto change) {
        return refused([&](View& view) { change(*view.pinhole); });
    };
    EXPECT_EQ(refused_camera([](Pinhole& p) { p.fx = 0; }), "bad_input");
    EXPECT_EQ(refused_camera([](Pinhole& p) { p.fy = -3; }), "bad_input");
    EXPECT_EQ(refused_camera([](Pinhole& p) { p.cx = NAN; }), "bad_input");
    EXPECT_EQ(refused_camera([](Pinhole& p) { p.fx = 1e-30; }), "bad_input");
    EXPECT_EQ(refused_camera([](Pinhole& p) { p.to_world[2][3] = NAN; }), "bad_input");
    EXPECT_EQ(refused_camera([](Pinhole& p) { p.to_world[0][0] *= 1.01; }), "bad_input");
    EXPECT_EQ(refused_camera([](Pinhole& p) { p.to_world[2][2] *= -1; }), "bad_input");
    EXPECT_EQ(refused_camera([](Pinhole& p) { p.to_world = {}; }), "bad_input");
}

}  // namespace
}  // namespace mray::test
