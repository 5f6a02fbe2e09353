// The choice between packets and streams of single rays: answers do not depend on it.
#include "cpu/image/tile_tracer.h"

#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "common/bvh/builder/bvh_builder.h"
#include "common/interop/camera.h"
#include "common/scene/camera_setup.h"
#include "cpu/reference/scalar_tracer.h"
#include "tests/support/same_bits.h"
#include "tests/support/test_scene.h"

namespace mray {
namespace {

using namespace test;

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

class TileChoice : public testing::TestWithParam<SimdTarget> {
protected:
    /// A view of a scene from so many times as far away as the default one.
    static ImageParams params_from(const TestScene& scene, double distance, std::uint32_t width,
                                   std::uint32_t height) {
        const WorldBounds bounds = bounds_of(scene.world_positions());
        ViewSpec view;
        view.width = width;
        view.height = height;
        const ResolvedView whole = resolve_view(view, bounds);
        std::array<double, 3> eye = whole.eye;
        for (std::size_t axis = 0; axis < 3; ++axis)
            eye[axis] = whole.target[axis] + distance * (eye[axis] - whole.target[axis]);
        view.eye = eye;
        view.target = whole.target;
        view.light = whole.light;
        return make_image_params(view, bounds, scene.space());
    }
};

TEST_P(TileChoice, GivesCameraPacketsUpWhereTrianglesAreSmallerThanPixels) {
    const TestScene scene = random_soup(40000, 0.03, 3);
    const Bvh bvh = build_bvh(scene.topology(), scene.positions());
    const cpu::ScalarTracer scalar(bvh);
    // With blocks that are not full, too.
    const struct {
        double distance;
        std::uint32_t width, height;
    } views[] = {{5, 64, 64}, {5, 61, 50}, {0.2, 64, 64}, {0.2, 61, 50}};
    for (const auto& [distance, width, height] : views) {
        const ImageParams params = params_from(scene, distance, width, height);
        const cpu::Tile tile{0, 0, width, height};
        std::vector<Hit> hits(std::size_t{width} * height), streamed = hits;
        const cpu::TileTracer chosen(bvh, GetParam());
        EXPECT_EQ(chosen.intersect_camera(params, tile, hits.data(), width) == nullptr,
                  distance > 1);
        const cpu::TileTracer always(bvh, GetParam(), cpu::PacketUse::kAlways);
        std::vector<Hit> packed = hits;
        EXPECT_NE(always.intersect_camera(params, tile, packed.data(), width), nullptr);
        chosen.ImageTracer::intersect_camera(params, tile, streamed.data(), width);
        std::size_t hit_count = 0;
        for (std::uint32_t y = 0; y < height; ++y) {
            for (std::uint32_t x = 0; x < width; ++x) {
                const std::size_t i = std::size_t{y} * width + x;
                const Hit expected = scalar.intersect(camera_ray(params.camera, x, y));
                ASSERT_TRUE(same_bits(hits[i], expected)) << x << " " << y;
                ASSERT_TRUE(same_bits(packed[i], expected)) << x << " " << y;
                ASSERT_TRUE(same_bits(streamed[i], expected)) << x << " " << y;
                hit_count += expected.prim_id != kNoPrim;
            }
        }
        EXPECT_GT(hit_count, 20u);
    }
}

TEST_P(TileChoice, AnswersShadowRaysAlikeWhateverTheCountsSay) {
    const TestScene scene = random_soup(3000, 0.05, 5);
    const Bvh bvh = build_bvh(scene.topology(), scene.positions());
    const cpu::ScalarTracer scalar(bvh);
    Random random(7);
    const vec3 org = snap_point(vec3(0.9f * kSceneExtent));
    // Rays of neighbours, and rays among which no block has neighbours: a light packet of these is
    // given up.
    for (const bool alike : {true, false}) {
        std::vector<Ray> rays;
        std::vector<cpu::SharedOriginRays> blocks(cpu::kLightPacketBlocks,
                                                  cpu::SharedOriginRays::none());
        std::size_t count = 0;
        for (std::uint32_t i = 0; i < cpu::kLightPacketRays; ++i) {
            const vec3 place =
                alike ? vec3(static_cast<float>(i) / cpu::kLightPacketRays - 0.5f, 0.0f, 0.0f) *
                            kSceneExtent
                      : random.point(0.5 * kSceneExtent);
            const vec3 way = snap_point(place) - org;
            rays.push_back(
                {org, 0, canonical_direction(way), power_of_two_below(largest_component(way)) * 2});
            if (i % 7 == 3) continue;
            blocks[i / cpu::kBlockRays].set(i % cpu::kBlockRays, rays[i]);
            ++count;
        }
        std::size_t block_count = 0;
        for (const cpu::SharedOriginRays& block : blocks) block_count += block.count();
        EXPECT_EQ(block_count, count);
        auto packet = std::make_unique<cpu::LightPacket>();
        std::vector<std::uint8_t> occluded(rays.size());
        std::vector<std::uint16_t> fallback(rays.size());
        const cpu::PacketTracer packets(bvh, GetParam(), cpu::PacketUse::kWhereItPays);
        const std::size_t left =
            packets.occluded_shared_origin(org, blocks, *packet, occluded.data(), fallback.data());
        EXPECT_EQ(left == count, !alike) << left;
        const cpu::TileTracer tracer(bvh, GetParam());
        std::size_t dark = 0;
        for (const std::size_t leaves : {std::size_t{0}, count / 8, count, std::size_t{kNone}}) {
            occluded.assign(rays.size(), 9);
            tracer.occluded_shared_origin(org, blocks, occluded, {count, leaves});
            for (std::size_t i = 0; i < rays.size(); ++i) {
                const bool expected = i % 7 == 3 || scalar.occluded(rays[i]);
                ASSERT_EQ(occluded[i], expected ? 1 : 0) << i << ", leaves " << leaves;
                dark += expected && i % 7 != 3;
            }
        }
        EXPECT_GT(dark, 400u);
        EXPECT_LT(dark, 4 * count);
    }
}

INSTANTIATE_TEST_SUITE_P(Tiles, TileChoice, testing::ValuesIn(supported_simd_targets()),
                         [](const auto& target) { return std::string(target.param.name); });

}  // namespace
}  // namespace mray
