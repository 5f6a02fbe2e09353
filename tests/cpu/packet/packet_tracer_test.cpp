#include "cpu/packet/packet_tracer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "common/base/errors.h"
#include "common/bvh/builder/bvh_builder.h"
#include "common/interop/camera.h"
#include "common/scene/camera_setup.h"
#include "cpu/image/image_tracer.h"
#include "cpu/reference/brute_tracer.h"
#include "cpu/reference/scalar_tracer.h"
#include "cpu/refit/refit.h"
#include "tests/cpu/packet/light_rays.h"
#include "tests/cpu/packet/wedge_check.h"
#include "tests/support/same_bits.h"
#include "tests/support/test_scene.h"

namespace mray {
namespace {

using namespace test;

/// The image of a view, traced tile by tile.
std::vector<Hit> packet_image(const cpu::PacketTracer& tracer, const ImageParams& params,
                              cpu::CameraPacket& packet) {
    std::vector<Hit> hits(std::size_t{params.width} * params.height);
    const cpu::ImageTiles tiles(params.width, params.height, cpu::kCameraSide);
    for (std::uint32_t i = 0; i < tiles.count(); ++i) {
        const cpu::Tile tile = tiles[i];
        tracer.intersect_camera(params, tile, packet,
                                &hits[std::size_t{tile.y0} * params.width + tile.x0], params.width);
    }
    return hits;
}

template <class Reference>
std::size_t count_differences(const Reference& reference, const ImageParams& params,
                              const std::vector<Hit>& hits) {
    std::size_t differences = 0;
    for (std::uint32_t y = 0; y < params.height; ++y) {
        for (std::uint32_t x = 0; x < params.width; ++x) {
            const Hit expected = reference.intersect(camera_ray(params.camera, x, y));
            differences += !same_bits(expected, hits[std::size_t{y} * params.width + x]);
        }
    }
    return differences;
}

ViewSpec view_of(std::uint32_t width, std::uint32_t height) {
    ViewSpec view;
    view.width = width;
    view.height = height;
    return view;
}

/// Views from outside, from inside, from a vertex, from the middle of an edge, wide and narrow.
std::vector<ViewSpec> views(const TestScene& scene, std::uint64_t seed) {
    Random random(seed);
    const WorldBounds bounds = bounds_of(scene.world_positions());
    const auto inside = [&] {
        Point p{};
        for (std::size_t axis = 0; axis < 3; ++axis)
            p[axis] = random.real(bounds.lower[axis], bounds.upper[axis]);
        return p;
    };
    const auto finite_vertex = [&]() -> vec3 {
        for (int i = 0; i < 100; ++i) {
            const std::uint32_t v =
                random.below(static_cast<std::uint32_t>(scene.positions().size()));
            if (scene.positions()[v].x <= kSceneExtent) return scene.world_positions()[v];
        }
        return vec3(0, 0, 0);
    };
    std::vector<ViewSpec> all = {view_of(45, 37)};
    if (bounds.empty() || scene.positions().empty()) return all;
    for (int i = 0; i < 5; ++i) {
        ViewSpec view = view_of(i % 2 == 0 ? 33 : 128, i % 2 == 0 ? 70 : 64);
        const vec3 a = finite_vertex();
        const vec3 b = finite_vertex();
        const Point eyes[] = {
            inside(), Point{a.x, a.y, a.z},
            Point{(double{a.x} + b.x) / 2, (double{a.y} + b.y) / 2, (double{a.z} + b.z) / 2},
            inside(), inside()};
        view.eye = eyes[i];
        view.target = inside();
        view.up = {0.1, 1, 0.05};
        view.fov = i == 3 ? 2.0 : random.real(20, 140);
        all.push_back(view);
    }
    return all;
}

/// The image of a view of a scene; none if its eye and target coincide, as in a scene of one point.
std::optional<ImageParams> params_of(const ViewSpec& view, const TestScene& scene) {
    try {
        return make_image_params(view, bounds_of(scene.world_positions()), scene.space());
    } catch (const Error& error) {
        if (error.kind() != ErrorKind::kBadInput || view.eye != view.target) throw;
        return std::nullopt;
    }
}

class EveryTarget : public testing::TestWithParam<SimdTarget> {
protected:
    std::unique_ptr<cpu::CameraPacket> camera_packet_ = std::make_unique<cpu::CameraPacket>();
    std::unique_ptr<cpu::LightPacket> light_packet_ = std::make_unique<cpu::LightPacket>();
};

TEST_P(EveryTarget, CameraPacketsAnswerLikeSingleRaysFromAnywhere) {
    std::size_t traced = 0;
    std::size_t refused = 0;
    for (const NamedScene& named : adversarial_scenes()) {
        const TestScene& scene = named.scene;
        const Bvh bvh = build_bvh(scene.topology(), scene.positions());
        const cpu::PacketTracer tracer(bvh, GetParam());
        for (const ViewSpec& view : views(scene, 71)) {
            const std::optional<ImageParams> params = params_of(view, scene);
            ++(params ? traced : refused);
            if (!params) continue;
            const std::vector<Hit> hits = packet_image(tracer, *params, *camera_packet_);
            EXPECT_EQ(count_differences(cpu::ScalarTracer(bvh), *params, hits), 0u) << named.name;
        }
    }
    EXPECT_GT(traced, 100u);
    EXPECT_LE(refused, 5u);
}

TEST_P(EveryTarget, CameraPacketsHaveWedgesThatHoldAllRays) {
    std::size_t sides = 0;
    double outside = 0;
    for (const NamedScene& named : adversarial_scenes()) {
        const TestScene& scene = named.scene;
        const Bvh bvh = build_bvh(scene.topology(), scene.positions());
        const cpu::PacketTracer tracer(bvh, GetParam());
        std::vector<Hit> hits(std::size_t{cpu::kCameraSide} * cpu::kCameraSide);
        for (const ViewSpec& view : views(scene, 72)) {
            const std::optional<ImageParams> params = params_of(view, scene);
            if (!params) continue;
            const cpu::ImageTiles tiles(params->width, params->height, cpu::kCameraSide);
            for (std::uint32_t i = 0; i < tiles.count(); ++i) {
                const cpu::Tile tile = tiles[i];
                tracer.intersect_camera(*params, tile, *camera_packet_, hits.data(),
                                        cpu::kCameraSide);
                const cpu::PacketFrame& frame = camera_packet_->frame;
                sides += frame.wedge_side_count;
                for (std::uint32_t y = tile.y0; y < tile.y1; ++y)
                    for (std::uint32_t x = tile.x0; x < tile.x1; ++x)
                        outside = std::min(
                            outside,
                            least_inside_wedges(frame, camera_ray(params->camera, x, y).dir));
            }
        }
    }
    EXPECT_GT(sides, 100u);
    EXPECT_GE(outside, -0x1p-20);
}

TEST_P(EveryTarget, CameraPacketsAnswerLikeBruteForceOnRandomSmallCases) {
    for (std::uint64_t seed = 0; seed < 400; ++seed) {
        Random random(seed);
        const double size = std::ldexp(1.0, -static_cast<int>(random.below(12)));
        const TestScene scene = random_soup(1 + random.below(60), size, seed);
        const Bvh bvh = build_bvh(scene.topology(), scene.positions());
        const cpu::PacketTracer tracer(bvh, GetParam());
        const std::uint32_t most = seed % 4 == 0 ? 100 : 40;
        ViewSpec view = view_of(1 + random.below(most), 1 + random.below(most));
        const vec3 eye = random.point(seed % 3 == 0 ? 1 : 4);
        const vec3 target = scene.world_positions()[random.below(
            static_cast<std::uint32_t>(scene.world_positions().size()))];
        view.eye = Point{eye.x, eye.y, eye.z};
        view.target = Point{target.x, target.y, target.z};
        view.up = {0.3, 1, 0.2};
        view.fov = random.real(1, 120);
        const ImageParams params =
            make_image_params(view, bounds_of(scene.world_positions()), scene.space());
        const std::vector<Hit> hits = packet_image(tracer, params, *camera_packet_);
        ASSERT_EQ(
            count_differences(cpu::BruteTracer(scene.topology(), scene.positions()), params, hits),
            0u)
            << seed;
    }
}

TEST_P(EveryTarget, CameraPacketsAnswerLikeBruteForceAmongTrianglesThatReachPastTheEye) {
    std::size_t hit_count = 0;
    for (std::uint64_t seed = 0; seed < 300; ++seed) {
        Random random(seed);
        const vec3 eye = random.point(0.3);
        const TestScene scene = triangles_past(eye, seed);
        const Bvh bvh = build_bvh(scene.topology(), scene.positions());
        ViewSpec view = view_of(64, 64);
        const vec3 target = eye + random.point();
        view.eye = {eye.x, eye.y, eye.z};
        view.target = {target.x, target.y, target.z};
        view.up = {0.1, 1, 0.05};
        view.fov = std::ldexp(150.0, -static_cast<int>(seed % 6));
        const ImageParams params =
            make_image_params(view, bounds_of(scene.world_positions()), scene.space());
        const std::vector<Hit> hits =
            packet_image(cpu::PacketTracer(bvh, GetParam()), params, *camera_packet_);
        const cpu::BruteTracer brute(scene.topology(), scene.positions());
        EXPECT_EQ(count_differences(brute, params, hits), 0u) << seed;
        for (const Hit& hit : hits) hit_count += hit.prim_id != kNoPrim;
    }
    EXPECT_GT(hit_count, 100000u);
}

TEST_P(EveryTarget, CameraPacketsAnswerAlikeOnARefittedTree) {
    const TestScene before = random_soup(600, 0.2, 21);
    const TestScene after = random_soup(600, 0.2, 22);
    Bvh bvh = build_bvh(before.topology(), before.positions());
    cpu::refit(bvh, after.positions());
    const ImageParams params =
        make_image_params(view_of(96, 80), bounds_of(after.world_positions()), after.space());
    const std::vector<Hit> hits =
        packet_image(cpu::PacketTracer(bvh, GetParam()), params, *camera_packet_);
    const cpu::BruteTracer brute(after.topology(), after.positions());
    EXPECT_EQ(count_differences(brute, params, hits), 0u);
    EXPECT_GT(std::ranges::count_if(hits, [](const Hit& hit) { return hit.prim_id != kNoPrim; }),
              500);
}

TEST_P(EveryTarget, LightPacketsAnswerLikeSingleRaysForFullPartialAndEmptyMasks) {
    std::vector<Ray> rays(cpu::kLightPacketRays);
    std::vector<std::uint8_t> active(cpu::kLightPacketRays);
    std::vector<std::uint8_t> occluded(cpu::kLightPacketRays);
    std::size_t decided = 0;
    for (const NamedScene& named : adversarial_scenes()) {
        const TestScene& scene = named.scene;
        const Bvh bvh = build_bvh(scene.topology(), scene.positions());
        const cpu::PacketTracer tracer(bvh, GetParam());
        const cpu::ScalarTracer scalar(bvh);
        for (std::uint64_t seed = 0; seed < 12; ++seed) {
            Random random(seed);
            const vec3 org = snap_point(random.point((seed % 3 == 0 ? 0.5 : 3) * kSceneExtent));
            const vec3 towards = random.point(kSceneExtent);
            const double spread = std::ldexp(kSceneExtent, -static_cast<int>(random.below(16)));
            for (std::uint32_t i = 0; i < cpu::kLightPacketRays; ++i) {
                const vec3 target = snap_point(towards + random.point(spread));
                rays[i].org = org;
                rays[i].tnear = 0;
                rays[i].dir = canonical_direction(target - org);
                rays[i].tfar = power_of_two_below(largest_component(target - org)) *
                               (seed % 2 == 0 ? 1.0f : 4.0f);
                active[i] = seed == 3 ? 0 : seed == 4 ? i % 5 == 0 : seed == 5 ? i == 700 : 1;
            }
            const std::vector<cpu::SharedOriginRays> blocks = blocks_of(rays, active);
            std::fill(occluded.begin(), occluded.end(), std::uint8_t{9});
            std::vector<std::uint16_t> fallback(cpu::kLightPacketRays);
            const std::size_t count = cpu::kSquareRays * (4 - seed % 4);
            const std::size_t fallback_count =
                tracer.occluded_shared_origin(org, std::span(blocks).first(count / cpu::kBlockRays),
                                              *light_packet_, occluded.data(), fallback.data());
            std::vector<bool> is_fallback(cpu::kLightPacketRays);
            for (std::size_t k = 0; k < fallback_count; ++k) {
                ASSERT_TRUE(active[fallback[k]] != 0 && !is_fallback[fallback[k]]);
                is_fallback[fallback[k]] = true;
            }
            for (std::size_t i = count; i < cpu::kLightPacketRays; ++i) ASSERT_EQ(occluded[i], 9);
            for (std::uint32_t i = 0; i < count; ++i) {
                if (is_fallback[i]) continue;
                ++decided;
                const int expected = active[i] == 0 || scalar.occluded(rays[i]) ? 1 : 0;
                ASSERT_EQ(occluded[i], expected) << named.name << " " << seed << " " << i;
            }
        }
    }
    EXPECT_GT(decided, 100u * cpu::kSquareRays);
}

TEST_P(EveryTarget, ShadowRaysOfTheVisibleSurfaceAnswerLikeSingleRays) {
    std::size_t decided = 0;
    std::size_t dark = 0;
    for (const NamedScene& named : adversarial_scenes()) {
        const TestScene& scene = named.scene;
        const Bvh bvh = build_bvh(scene.topology(), scene.positions());
        const cpu::PacketTracer tracer(bvh, GetParam());
        const cpu::ScalarTracer scalar(bvh);
        const ImageParams params =
            make_image_params(view_of(64, 64), bounds_of(scene.world_positions()), scene.space());
        const cpu::ShadedMesh mesh{&scene.topology(), scene.positions()};
        std::vector<Ray> rays(cpu::kLightPacketRays);
        std::vector<std::uint8_t> active(cpu::kLightPacketRays, 0);
        std::vector<std::uint8_t> occluded(cpu::kLightPacketRays, 0);
        for (std::uint32_t y = 0; y < 64; ++y) {
            for (std::uint32_t x = 0; x < 64; ++x) {
                const Ray ray = camera_ray(params.camera, x, y);
                const Hit hit = scalar.intersect(ray);
                if (hit.prim_id == kNoPrim) continue;
                const std::uint32_t i = cpu::light_packet_ray(x, y);
                rays[i] = shadow_ray(mesh.surface(ray, hit), params.light);
                active[i] = 1;
            }
        }
        std::vector<std::uint16_t> fallback(cpu::kLightPacketRays);
        const std::size_t fallback_count =
            tracer.occluded_shared_origin(params.light, blocks_of(rays, active), *light_packet_,
                                          occluded.data(), fallback.data());
        for (std::size_t k = 0; k < fallback_count; ++k) active[fallback[k]] = 0;
        for (std::uint32_t i = 0; i < cpu::kLightPacketRays; ++i) {
            if (active[i] == 0) continue;
            ++decided;
            dark += occluded[i] != 0;
            ASSERT_EQ(occluded[i] != 0, scalar.occluded(rays[i])) << named.name;
        }
    }
    EXPECT_GT(decided, 10000u);
    EXPECT_GT(dark, 100u);
    EXPECT_LT(dark, decided);
}

INSTANTIATE_TEST_SUITE_P(Packets, EveryTarget, testing::ValuesIn(supported_simd_targets()),
                         [](const auto& target) { return std::string(target.param.name); });

}  // namespace
}  // namespace mray
