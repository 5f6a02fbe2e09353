#include "cpu/packet/packet_tracer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <span>
#include <vector>

#include "common/bvh/builder/bvh_builder.h"
#include "common/interop/camera.h"
#include "common/scene/camera_setup.h"
#include "cpu/image/image_tracer.h"
#include "cpu/reference/brute_tracer.h"
#include "cpu/reference/scalar_tracer.h"
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

class EveryTarget : public testing::TestWithParam<SimdTarget> {
protected:
    std::unique_ptr<cpu::CameraPacket> camera_packet_ = std::make_unique<cpu::CameraPacket>();
    std::unique_ptr<cpu::LightPacket> light_packet_ = std::make_unique<cpu::LightPacket>();
};

TEST_P(EveryTarget, CameraPacketsAnswerLikeSingleRaysFromAnywhere) {
    for (const NamedScene& named : adversarial_scenes()) {
        const TestScene& scene = named.scene;
        const Bvh bvh = build_bvh(scene.topology(), scene.positions());
        const cpu::PacketTracer tracer(bvh, GetParam());
        for (const ViewSpec& view : views(scene, 71)) {
            ImageParams params;
            try {
                params = make_image_params(view, bounds_of(scene.world_positions()), scene.space());
            } catch (const std::exception&) {
                continue;  // eye and target coincide in a scene of one point
            }
            const std::vector<Hit> hits = packet_image(tracer, params, *camera_packet_);
            EXPECT_EQ(count_differences(cpu::ScalarTracer(bvh), params, hits), 0u) << named.name;
        }
    }
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

TEST_P(EveryTarget, CameraPacketsAnswerAlikeOnARefittedTree) {
    const TestScene before = random_soup(600, 0.2, 21);
    const TestScene after = random_soup(600, 0.2, 22);
    Bvh bvh = build_bvh(before.topology(), before.positions());
    Bvh rebuilt = build_bvh(after.topology(), after.positions());
    for (std::size_t leaf = 0; leaf < bvh.leaves.size(); ++leaf) {
        for (std::size_t slot = 0; slot < kLeafVertices; ++slot) {
            const vec3 p = after.positions()[bvh.leaf_vertices[leaf * kLeafVertices + slot]];
            bvh.leaves[leaf].vertex[slot].x = p.x;
            bvh.leaves[leaf].vertex[slot].y = p.y;
            bvh.leaves[leaf].vertex[slot].z = p.z;
        }
    }
    // Boxes that hold the whole scene: the answer depends on the triangles alone.
    for (Node& node : bvh.nodes) {
        for (std::uint32_t slot = 0; slot < kWidth && node.child[slot] != kEmptyChild; ++slot) {
            node.lower_x[slot] = node.lower_y[slot] = node.lower_z[slot] = -kSceneExtent;
            node.upper_x[slot] = node.upper_y[slot] = node.upper_z[slot] = kSceneExtent;
        }
    }
    const ImageParams params =
        make_image_params(view_of(96, 80), bounds_of(after.world_positions()), after.space());
    const std::vector<Hit> hits =
        packet_image(cpu::PacketTracer(bvh, GetParam()), params, *camera_packet_);
    EXPECT_EQ(count_differences(cpu::ScalarTracer(rebuilt), params, hits), 0u);
}

/// Blocks of the active rays; the others are absent.
std::vector<cpu::SharedOriginRays> blocks_of(std::span<const Ray> rays,
                                             std::span<const std::uint8_t> active) {
    std::vector<cpu::SharedOriginRays> blocks(rays.size() / cpu::kBlockRays,
                                              cpu::SharedOriginRays::none());
    for (std::size_t i = 0; i < rays.size(); ++i) {
        if (active[i] != 0) blocks[i / cpu::kBlockRays].set(i % cpu::kBlockRays, rays[i]);
    }
    return blocks;
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
            ASSERT_EQ(occluded[i] != 0, scalar.occluded(rays[i])) << named.name;
        }
    }
}

INSTANTIATE_TEST_SUITE_P(Packets, EveryTarget, testing::ValuesIn(supported_simd_targets()),
                         [](const auto& target) { return std::string(target.param.name); });

}  // namespace
}  // namespace mray
