#include "cpu/packet/packet_tracer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <vector>

#include "common/base/errors.h"
#include "common/bvh/builder/bvh_builder.h"
#include "common/interop/camera.h"
#include "common/scene/camera_setup.h"
#include "cpu/reference/scalar_tracer.h"
#include "tests/cpu/packet/light_rays.h"
#include "tests/cpu/packet/wedge_check.h"
#include "tests/support/same_bits.h"
#include "tests/support/test_scene.h"

namespace mray {
namespace {

using namespace test;

/// The sides of wedges, and the farthest that a ray is outside of its packet's.
struct WedgeTally {
    std::size_t sides = 0;
    double outside = 0;
};

/// The image of a view, traced tile by tile.
std::vector<Hit> packet_image(const cpu::PacketTracer& tracer, const ImageParams& params,
                              cpu::CameraPacket& packet, WedgeTally* tally = nullptr) {
    std::vector<Hit> hits(std::size_t{params.width} * params.height);
    const cpu::ImageTiles tiles(params.width, params.height, cpu::kCameraSide);
    for (std::uint32_t i = 0; i < tiles.count(); ++i) {
        const cpu::Tile tile = tiles[i];
        tracer.intersect_camera(params, tile, packet,
                                &hits[std::size_t{tile.y0} * params.width + tile.x0], params.width);
        if (tally == nullptr) continue;
        tally->sides += packet.frame.wedge_side_count;
        for (std::uint32_t y = tile.y0; y < tile.y1; ++y) {
            for (std::uint32_t x = tile.x0; x < tile.x1; ++x) {
                const vec3 dir = camera_ray(params.camera, x, y).dir;
                tally->outside = std::min(tally->outside, least_inside_wedges(packet.frame, dir));
            }
        }
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
        glm::dvec3 p(0.0);
        for (int axis = 0; axis < 3; ++axis)
            p[axis] = random.real(bounds.lower[axis], bounds.upper[axis]);
        return to_point(p);
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
};

TEST_P(EveryTarget, CameraPacketsAnswerLikeSingleRaysFromAnywhereWithinTheirWedges) {
    WedgeTally tally;
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
            const std::vector<Hit> hits = packet_image(tracer, *params, *camera_packet_, &tally);
            EXPECT_EQ(count_differences(cpu::ScalarTracer(bvh), *params, hits), 0u) << named.name;
        }
    }
    EXPECT_GT(traced, 100u);
    EXPECT_LE(refused, 5u);
    EXPECT_GT(tally.sides, 100u);
    EXPECT_GE(tally.outside, -0x1p-20);
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

INSTANTIATE_TEST_SUITE_P(Packets, EveryTarget, testing::ValuesIn(supported_simd_targets()),
                         [](const auto& target) { return std::string(target.param.name); });

}  // namespace
}  // namespace mray
