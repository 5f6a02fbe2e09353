#include "cpu/image/pixel_shader.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "common/interop/camera.h"
#include "common/interop/shading.h"
#include "common/scene/camera_setup.h"
#include "tests/support/test_scene.h"

namespace mray {
namespace {

using namespace test;

class EveryTarget : public testing::TestWithParam<SimdTarget> {};

/// Hits that no tracer finds: neighbours share triangles in regions of any shape, and some
/// triangles have no normal.
TEST_P(EveryTarget, ShadesWhatNeighboursShareAndTrianglesWithoutANormal) {
    const TestScene scene = star(3, 7);
    Topology topology = scene.topology();
    const auto count = static_cast<std::uint32_t>(topology.triangles.size());
    Random random(9);
    for (Albedo& albedo : topology.albedo) albedo = static_cast<Albedo>(random.bits()) & 0xFFFFFFu;
    ViewSpec view;
    view.width = 64;
    view.height = 32;
    const ImageParams params =
        make_image_params(view, bounds_of(scene.world_positions()), scene.space());
    for (const bool with_degenerate : {false, true}) {
        if (with_degenerate) topology.triangles[5].y = topology.triangles[5].x;
        const cpu::ShadedMesh mesh{&topology, scene.positions()};
        Frame frame;
        frame.width = params.width;
        frame.height = params.height;
        frame.pixels.assign(std::size_t{params.width} * params.height, 99);
        frame.occlusion.assign(frame.pixels.size(), 77);
        for (std::size_t i = 0; i < frame.pixels.size(); ++i) {
            const std::uint32_t prim =
                random.below(4) == 0 ? random.below(count) : 4 + random.below(2);
            frame.hits.push_back({static_cast<float>(random.real(0.1, 4)) * kSceneExtent, 0, 0,
                                  random.below(9) == 0 ? kNoPrim : prim});
        }
        const cpu::Tile tile{0, 0, params.width, params.height};
        cpu::PixelShader(GetParam()).shade_camera({params, mesh, tile, frame});
        for (std::uint32_t y = 0; y < params.height; ++y) {
            for (std::uint32_t x = 0; x < params.width; ++x) {
                const std::size_t i = std::size_t{y} * params.width + x;
                const Hit& hit = frame.hits[i];
                const Ray ray = camera_ray(params.camera, x, y);
                const std::uint32_t expected = hit.prim_id == kNoPrim
                                                   ? background(y, params.height)
                                                   : shade(params, ray, mesh.surface(ray, hit),
                                                           topology.albedo[hit.prim_id], 0);
                ASSERT_EQ(frame.pixels[i], expected) << x << ", " << y;
                ASSERT_EQ(frame.occlusion[i], 0u) << x << ", " << y;
            }
        }
    }
}

/// Colours of every albedo where a channel is about to round up, and of any intensities.
TEST_P(EveryTarget, RoundsColoursAsTheirText) {
    ImageParams params = {};
    params.width = params.height = cpu::kBlockSide;
    params.rays = kRaysShadow;
    Frame frame;
    frame.width = frame.height = params.width;
    frame.pixels.resize(cpu::kBlockRays);
    frame.occlusion.resize(cpu::kBlockRays);
    const cpu::ShadedMesh mesh{};
    const cpu::Tile tile{0, 0, params.width, params.height};
    const std::uint8_t occluded[cpu::kBlockRays] = {};
    const cpu::PixelShader shader(GetParam());
    Random random(5);
    for (std::uint32_t i = 0; i < 256 * 256; ++i) {
        const double step = (i / 256 + 0.5) / 255;
        const double channel = i % 256;
        cpu::LitPixels lit;
        for (std::uint32_t ray = 0; ray < cpu::kBlockRays; ++ray) {
            const double at_step = 255 * step * step / channel * (1 + random.real(-1, 1) * 0x1p-19);
            const bool is_near = at_step > kUnlitIntensity && at_step < 1 && ray % 4 == 0;
            lit.intensity[ray] =
                static_cast<float>(is_near ? at_step : random.real(kUnlitIntensity, 1));
            lit.albedo[ray] = (static_cast<Albedo>(random.bits()) & 0xFFFF00u) | i % 256;
        }
        shader.shade_shadows({params, mesh, tile, frame}, occluded, &lit);
        for (std::uint32_t ray = 0; ray < cpu::kBlockRays; ++ray) {
            const std::uint32_t pixel =
                ray % cpu::kBlockSide * cpu::kBlockSide + ray / cpu::kBlockSide;
            ASSERT_EQ(frame.pixels[pixel], colour_of(lit.intensity[ray], lit.albedo[ray]))
                << lit.intensity[ray] << ", " << lit.albedo[ray];
        }
    }
}

INSTANTIATE_TEST_SUITE_P(Shading, EveryTarget, testing::ValuesIn(supported_simd_targets()),
                         [](const auto& target) { return std::string(target.param.name); });

}  // namespace
}  // namespace mray
