#include "cpu/image/pixel_shader.h"

#include <gtest/gtest.h>

#include <array>
#include <string>
#include <vector>

#include "common/bvh/builder/bvh_builder.h"
#include "common/scene/camera_setup.h"
#include "cpu/image/image_tracer.h"
#include "cpu/image/tile_tracer.h"
#include "cpu/reference/scalar_tracer.h"
#include "tests/support/test_scene.h"

namespace mray {
namespace {

using namespace test;

using ScalarTiles = cpu::BatchTiles<cpu::OneByOne<cpu::ScalarTracer>>;

/// An image in tiles of some size, traced by trace(tile, frame), with rubbish where that has to
/// write.
template <class Trace>
Frame image(const ImageParams& params, std::uint32_t side, Trace trace) {
    Frame frame;
    frame.width = params.width;
    frame.height = params.height;
    const std::size_t count = std::size_t{params.width} * params.height;
    frame.hits.assign(count, Hit{1, 2, 3, 4});
    frame.occlusion.assign(count, 77);
    frame.pixels.assign(count, 99);
    const cpu::ImageTiles tiles(params.width, params.height, side);
    for (std::uint32_t i = 0; i < tiles.count(); ++i) trace(tiles[i], frame);
    return frame;
}

struct ImageSize {
    std::uint32_t width, height;
};
// With rows and columns of blocks that are not full, none that are, and more than a strip.
constexpr ImageSize kSizes[] = {{64, 64}, {67, 45}, {1, 1}, {3, 9}, {5, 2}, {130, 6}};

class EveryTarget : public testing::TestWithParam<SimdTarget> {
protected:
    /// All kinds of rays, with colours of their own for triangles.
    void expect_same_images(const NamedScene& named, const ViewSpec& view) {
        const TestScene& scene = named.scene;
        Topology topology = scene.topology();
        Random random(5);
        for (Albedo& albedo : topology.albedo)
            albedo = static_cast<Albedo>(random.bits()) & 0x00FFFFFFu;
        const Bvh bvh = build_bvh(topology, scene.positions());
        const cpu::ShadedMesh mesh{&topology, scene.positions()};
        ImageParams params =
            make_image_params(view, bounds_of(scene.world_positions()), scene.space());
        for (const std::uint32_t rays : {kRaysPrimary, kRaysShadow, kRaysAo}) {
            params.rays = rays;
            const ScalarTiles scalar(cpu::OneByOne{cpu::ScalarTracer(bvh)});
            const Frame expected = image(params, 64, [&](const cpu::Tile& tile, Frame& frame) {
                trace_tile(scalar, mesh, params, tile, frame);
            });
            const cpu::TileTracer packets(bvh, GetParam());
            const auto expect_same = [&](const Frame& frame, const char* what) {
                SCOPED_TRACE(named.name + ", rays " + std::to_string(rays) + ", " + what);
                EXPECT_EQ(hits_hash(frame), hits_hash(expected));
                EXPECT_EQ(frame.occlusion, expected.occlusion);
                EXPECT_EQ(frame.pixels, expected.pixels);
            };
            const auto in_blocks = [&](const cpu::Tile& tile, Frame& frame) {
                trace_tile(packets, mesh, params, tile, frame);
            };
            expect_same(image(params, 64, in_blocks), "tiles of 64");
            expect_same(image(params, 32, in_blocks), "tiles of 32");
            if (rays != kRaysPrimary) continue;
            const auto at_once = [&](const cpu::Tile& tile, Frame& frame) {
                frame.hits = expected.hits;
                cpu::PixelShader(GetParam()).shade_camera({params, mesh, tile, frame});
            };
            expect_same(image(params, 130, at_once), "one part");
        }
    }
};

TEST_P(EveryTarget, ShadesAsTheSharedTextOnEveryScene) {
    for (const NamedScene& named : adversarial_scenes()) {
        for (const ImageSize size : kSizes) {
            ViewSpec view;
            view.width = size.width;
            view.height = size.height;
            view.ao_count = 1 + size.width % 4;
            expect_same_images(named, view);
        }
    }
}

TEST_P(EveryTarget, ShadesAlikeWithManySamplesAndFromInside) {
    for (const std::uint32_t samples : {16u, 100u, 256u}) {
        ViewSpec view;
        view.width = 37;
        view.height = 21;
        view.ao_count = samples;
        expect_same_images({"star", star(3, 7)}, view);
        view.eye = std::array{0.1, 0.05, -0.02};
        view.target = std::array{1.0, 0.4, 0.3};
        view.fov = 120;
        expect_same_images({"star from inside", star(3, 7)}, view);
    }
}

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
        const Frame frame = image(params, 64, [&](const cpu::Tile& tile, Frame& shaded) {
            for (std::size_t i = 0; i < shaded.hits.size(); ++i) {
                const std::uint32_t prim =
                    random.below(4) == 0 ? random.below(count) : 4 + random.below(2);
                shaded.hits[i] = {static_cast<float>(random.real(0.1, 4)) * kSceneExtent, 0, 0,
                                  random.below(9) == 0 ? kNoPrim : prim};
            }
            cpu::PixelShader(GetParam()).shade_camera({params, mesh, tile, shaded});
        });
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
            }
        }
    }
}

INSTANTIATE_TEST_SUITE_P(Shading, EveryTarget, testing::ValuesIn(supported_simd_targets()),
                         [](const auto& target) { return std::string(target.param.name); });

}  // namespace
}  // namespace mray
