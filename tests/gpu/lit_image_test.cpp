// Lit images and false colours that a device makes whole have the bits of the CPU's.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <vector>

#include "gpu/shared_device.h"
#include "library/src/device_impl.h"
#include "tests/library/scenes.h"

namespace mray::test {
namespace {

using morphray::Device;
using morphray::Image;
using morphray::Scene;
using morphray::Shading;
using morphray::View;

/// A coarse smooth ball, a box with smooth and flat corners, and a ground that shows the
/// background.
class Shapes {
public:
    Shapes() : ball_(icosphere(2)), torus_(torus(9, 6)) {
        ground_.points = {{-4, -1, -4}, {4, -1, -4}, {4, -1, 4}, {-4, -1, 4}};
        ground_.triangles = {0, 2, 1, 0, 3, 2};
        for (std::size_t i = 0; i < torus_.triangles.size() / 3; ++i)
            albedo_.push_back(0x203040u * static_cast<std::uint32_t>(i % 5) & 0xFFFFFF);
    }
    std::vector<morphray::MeshView> views() const {
        morphray::MeshView ball = ball_.view(), ring = torus_.view(), ground = ground_.view();
        ball.appearance.smooth = ball_.triangles;
        ring.appearance.albedo = albedo_;
        ground.appearance.shadow_catcher = true;
        return {ball, ring, ground};
    }
    /// Moves the ball, so that its normals turn.
    void squeeze() {
        for (morphray::Vec3& p : ball_.points) p = {p.x, 0.75f * p.y, p.z + 0.25f * p.y};
    }

private:
    UserMesh ball_, torus_, ground_;
    std::vector<std::uint32_t> albedo_;
};

Device device_with(gpu::Tuning tuning) {
    const std::shared_ptr<gpu::SharedDevice> shared = gpu::open_device({.validate = true}, tuning);
    return morphray::detail::DeviceImpl::make_on_device(
        [=] { return gpu::make_backend_on(shared, tuning); });
}

void expect_same_images(const Scene& scene, const Scene& twin, View view) {
    const Image image = scene.render(view), expected = twin.render(view);
    EXPECT_TRUE(morphray::compare(image, expected).equal());
    EXPECT_EQ(image.pixels, expected.pixels);
    EXPECT_EQ(image.linear, expected.linear);
    EXPECT_EQ(image.ray_count, expected.ray_count);
    view.hits = false;
    view.linear = false;
    const std::atomic<bool> cancel = false;
    view.cancel = &cancel;
    const Image pixels = scene.render(view);
    EXPECT_EQ(pixels.pixels, expected.pixels);
    EXPECT_EQ(pixels.ray_count, expected.ray_count);
}

TEST(LitImages, AreThoseOfTheCpuHoweverTheyAreDividedAndCopied) {
    using enum gpu::BufferKind;
    Shapes shapes;
    Scene twin = Scene::build(shapes.views());
    for (const gpu::Tuning& tuning : std::initializer_list<gpu::Tuning>{
             {.buffer_kind = kTexels},
             {.buffer_kind = kStorage, .force_staging = true},
             {.tiles_per_dispatch = 9},
             // Not enough for a region with neighbours, so the host shades.
             {.tiles_per_dispatch = 3},
             {.step_budget = 60, .resume_slots = 128}}) {
        Scene scene = twin.on(device_with(tuning));
        for (const Shading shading :
             {Shading::plain, Shading::lit, Shading::normal, Shading::depth, Shading::prim}) {
            for (const std::uint32_t samples : {1u, 16u}) {
                for (const std::uint32_t ao_count : {0u, 3u}) {
                    SCOPED_TRACE(testing::Message() << static_cast<int>(shading) << ", " << samples
                                                    << " samples, " << ao_count << " rays");
                    View view{.eye = morphray::Point{1, 2, 5},
                              .target = morphray::Point{0, 0, 0},
                              .light = morphray::Point{-4, 6, 2},
                              .width = 41,
                              .height = 27,
                              .rays = ao_count == 0 ? morphray::Rays::shadow : morphray::Rays::ao,
                              .shading = shading,
                              .samples = samples,
                              .linear = true,
                              .ao_count = ao_count};
                    if (shading != Shading::lit) view.ao_count = 3;
                    expect_same_images(scene, twin, view);
                    view.flat = true;
                    if (shading == Shading::lit) expect_same_images(scene, twin, view);
                }
            }
        }
    }
}

TEST(LitImages, FollowTheNormalsOfEachPose) {
    Shapes shapes;
    Scene twin = Scene::build(shapes.views());
    Scene scene = twin.on(device_with({}));
    for (int pose = 0; pose < 3; ++pose) {
        for (const Shading shading : {Shading::lit, Shading::normal})
            expect_same_images(scene, twin, {.width = 61, .height = 43, .shading = shading});
        shapes.squeeze();
        scene.update();
        twin.update();
    }
    twin.detach(0);
    scene.detach(0);
    scene.update();
    twin.update();
    expect_same_images(scene, twin, {.width = 61, .height = 43, .shading = Shading::lit});
}

}  // namespace
}  // namespace mray::test
