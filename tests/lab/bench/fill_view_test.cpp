// The part of a scene that the image shows.
#include <gtest/gtest.h>

#include "common/bvh/builder/bvh_builder.h"
#include "common/interop/camera.h"
#include "cpu/reference/scalar_tracer.h"
#include "lab/bench/bench_scene.h"
#include "tests/support/test_scene.h"

namespace mray::bench {
namespace {

using namespace test;

double hit_share(const TestScene& scene, const Bvh& bvh, ViewSpec view) {
    view.width = view.height = 100;
    const ImageParams params =
        make_image_params(view, bounds_of(scene.world_positions()), scene.space());
    const cpu::ScalarTracer tracer(bvh);
    int hits = 0;
    for (std::uint32_t y = 0; y < view.height; ++y) {
        for (std::uint32_t x = 0; x < view.width; ++x) {
            hits += tracer.occluded(camera_ray(params.camera, x, y));
        }
    }
    return hits / 1e4;
}

TEST(FillView, FillsTheImageWithTheScene) {
    for (const TestScene& scene : {icosphere(3), torus(24, 12), grid_box(4), star(4, 1)}) {
        const Bvh bvh = build_bvh(scene.topology(), scene.positions());
        const WorldBounds bounds = bounds_of(scene.world_positions());
        const ViewSpec view = fill_view({}, bounds, scene.space(), bvh);
        EXPECT_LT(hit_share(scene, bvh, {}), 0.8);
        // Turning the camera and other pixels shift some edge of the window.
        EXPECT_GT(hit_share(scene, bvh, view), kFullShare - 0.03);
        EXPECT_EQ(*view.eye, resolve_view({}, bounds).eye);
        EXPECT_EQ(*view.light, resolve_view({}, bounds).light);
    }
}

TEST(FillView, AcceptsEveryScene) {
    for (const NamedScene& named : adversarial_scenes()) {
        const TestScene& scene = named.scene;
        const Bvh bvh = build_bvh(scene.topology(), scene.positions());
        const WorldBounds bounds = bounds_of(scene.world_positions());
        const ViewSpec view = fill_view({}, bounds, scene.space(), bvh);
        EXPECT_NO_THROW(make_image_params(view, bounds, scene.space())) << named.name;
        EXPECT_GE(view.fov, ViewSpec{}.fov / (2 * kMaxZoom)) << named.name;
    }
}

}  // namespace
}  // namespace mray::bench
