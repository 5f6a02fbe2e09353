// The model of GPUs: warps in lockstep find what the reference does, and waiting is hidden by
// others.
#include <gtest/gtest.h>

#include "common/bvh/builder/bvh_builder.h"
#include "common/scene/camera_setup.h"
#include "cpu/reference/scalar_tracer.h"
#include "lab/gpu_model/gpu_time.h"
#include "tests/support/shapes.h"
#include "tests/support/test_scene.h"

namespace mray::test {
namespace {

using namespace lab;

TEST(GpuModel, WarpsFindWhatTheReferenceDoes) {
    const TestScene scene = torus(24, 12);
    ViewSpec view;
    view.width = view.height = 64;
    const ImageParams params =
        make_image_params(view, bounds_of(scene.world_positions()), scene.space());
    const Bvh bvh = build_bvh(scene.topology(), scene.positions());
    const PeerTree tree = build_peer_tree(scene.topology(), scene.positions(), 1, 4);
    for (std::uint32_t y = 0; y < view.height; ++y) {
        std::vector<Ray> rays;
        std::uint32_t hits = 0;
        for (std::uint32_t x = 16; x < 16 + kWarpLanes; ++x) {
            rays.push_back(camera_ray(params.camera, x, y));
            hits += cpu::ScalarTracer(bvh).occluded(rays.back()) ? 1 : 0;
        }
        const WarpTrace present = trace_warp(bvh, rays, false);
        EXPECT_EQ(present.hits, hits);
        EXPECT_EQ(trace_warp(tree, rays, false).hits, hits);
        // Four boxes are met by each lane of these steps.
        std::size_t boxes = 0;
        for (const Step& step : present.steps) {
            const bool is_of_boxes = step.kind == StepKind::kNode ||
                                     step.kind == StepKind::kQuarter ||
                                     step.kind == StepKind::kGroups;
            boxes += is_of_boxes ? 4 * step.active : 0;
        }
        EXPECT_EQ(present.boxes, boxes);
    }
}

TEST(GpuModel, OtherWarpsHideLatency) {
    const Card card{"card", 10, 1, 4, 2, 65536, 64, 1e5, 1, 1e7, 1, 1, 30, 300, 600};
    const std::vector<WarpLoad> warps(8, {{10, 10, 5, 0}, 1000});
    EXPECT_NEAR(dispatch_us(card, 1, warps, 10), 1.0, 1e-6);
    EXPECT_NEAR(dispatch_us(card, 1, warps, 20), 2.0, 1e-6);
    EXPECT_LT(dispatch_us(card, 2, warps, 20), 1.1);
}

}  // namespace
}  // namespace mray::test
