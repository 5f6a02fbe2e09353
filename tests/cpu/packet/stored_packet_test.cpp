// Packets of rays that a caller has stored give the hits of single rays.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>

#include "common/bvh/builder/bvh_builder.h"
#include "common/simd/simd_target.h"
#include "cpu/packet/packet_tracer.h"
#include "cpu/reference/scalar_tracer.h"
#include "tests/cpu/packet/wedge_check.h"
#include "tests/support/same_bits.h"
#include "tests/support/test_scene.h"

namespace mray::test {
namespace {

using cpu::kCameraSide;
using mray::StoredRay;

constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// How the directions of a tile differ from those of a camera.
enum class Finish { kNone, kNormalised, kAnyLength, kJittered };

/// A tile of rays in scene space.
struct StoredTile {
    std::vector<StoredRay> rays;
    std::uint32_t width = 0;
    std::uint32_t height = 0;
    vec3 org;

    StoredRayTile view() const { return {rays.data(), width, width, height, org}; }
};

vec3 any_vertex(const TestScene& scene, Random& random) {
    const auto& positions = scene.positions();
    return positions.empty()
               ? vec3(0)
               : positions[random.below(static_cast<std::uint32_t>(positions.size()))];
}

vec3 unit(vec3 v) {
    const double length = std::sqrt(double{v.x} * v.x + double{v.y} * v.y + double{v.z} * v.z);
    return length > 0 ? vec3(v.x / length, v.y / length, v.z / length) : vec3(0, 0, 1);
}

vec3 cross(vec3 a, vec3 b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// A tile of a pinhole camera that looks from around or inside a scene at one of its vertices.
StoredTile random_tile(const TestScene& scene, Finish finish, Random& random) {
    StoredTile tile;
    tile.width = 8 * (1 + random.below(8));
    tile.height = 8 * (1 + random.below(8));
    const vec3 at = any_vertex(scene, random);
    const float away = random.below(4) == 0 ? 0x1p12f : 0x1.8p20f;
    const vec3 from = any_vertex(scene, random);
    const vec3 jitter = random.point(away);
    tile.org = snap_point({from.x + jitter.x, from.y + jitter.y, from.z + jitter.z});
    const vec3 forward = unit({at.x - tile.org.x, at.y - tile.org.y, at.z - tile.org.z});
    const vec3 right = unit(cross(forward, unit(random.point())));
    const vec3 down = cross(forward, right);
    const float pixel = std::ldexp(1.0f, -static_cast<int>(3 + random.below(12)));
    // The tile may lie off the axis of its camera.
    const float x0 =
        static_cast<float>(random.real(-1, 1)) / pixel * (random.below(2) == 0 ? 1 : 0);
    for (std::uint32_t y = 0; y < tile.height; ++y) {
        for (std::uint32_t x = 0; x < tile.width; ++x) {
            const float shake = finish == Finish::kJittered ? 0.3f : 0.0f;
            const auto offset = [&] { return shake * static_cast<float>(random.real(-1, 1)); };
            const float px =
                (x0 + static_cast<float>(x) - 0.5f * static_cast<float>(tile.width) + offset()) *
                pixel;
            const float py =
                (static_cast<float>(y) - 0.5f * static_cast<float>(tile.height) + offset()) * pixel;
            vec3 d(forward.x + right.x * px + down.x * py, forward.y + right.y * px + down.y * py,
                   forward.z + right.z * px + down.z * py);
            if (finish == Finish::kNormalised) d = unit(d);
            if (finish == Finish::kAnyLength) {
                const auto length = static_cast<float>(random.real(0.1, 9)) *
                                    std::ldexp(1.0f, static_cast<int>(random.below(40)) - 20);
                d = {d.x * length, d.y * length, d.z * length};
            }
            tile.rays.push_back(
                {{tile.org.x, tile.org.y, tile.org.z}, 0, {d.x, d.y, d.z}, kInfinity});
        }
    }
    return tile;
}

struct Scratch {
    cpu::CameraPacket packet;
    cpu::StoredDirections directions;
    std::array<Hit, kCameraSide * kCameraSide> hits;
};

TEST(StoredPackets, AnswerLikeSingleRays) {
    Random random(71);
    const auto scratch = std::make_unique<Scratch>();
    // Counts for the best target; another one may have no such packets.
    std::size_t tiles = 0;
    std::size_t refused = 0;
    std::size_t hits = 0;
    std::size_t different = 0;
    std::size_t sides = 0;
    double outside = 0;
    for (const NamedScene& named : adversarial_scenes()) {
        const TestScene& scene = named.scene;
        const Bvh bvh = build_bvh(scene.topology(), scene.positions());
        const cpu::ScalarTracer single(bvh);
        for (const SimdTarget& target : supported_simd_targets()) {
            const cpu::PacketTracer packets(bvh, target);
            const bool is_best = target == best_simd_target();
            for (int i = 0; i < 12; ++i) {
                const StoredTile tile = random_tile(scene, static_cast<Finish>(i % 4), random);
                tiles += is_best;
                if (!packets.intersect_stored(tile.view(), scratch->directions, scratch->packet,
                                              scratch->hits.data())) {
                    refused += is_best;
                    continue;
                }
                sides += scratch->packet.frame.wedge_side_count;
                for (std::uint32_t y = 0; y < tile.height; ++y) {
                    for (std::uint32_t x = 0; x < tile.width; ++x) {
                        const float* d = tile.rays[y * tile.width + x].dir;
                        const Ray ray{tile.org, 0, canonical_direction({d[0], d[1], d[2]}),
                                      kInfiniteT};
                        const Hit expected = single.intersect(ray);
                        outside =
                            std::min(outside, least_inside_wedges(scratch->packet.frame, ray.dir));
                        hits += expected.prim_id != kNoPrim;
                        different += !same_bits(expected, scratch->hits[y * kCameraSide + x]);
                    }
                }
                ASSERT_EQ(different, 0u) << named.name << ", " << target.name << ", tile " << i;
            }
        }
    }
    // The scalar target has no such packets.
    if (std::string_view(best_simd_target().name) == "scalar") {
        EXPECT_EQ(refused, tiles);
        return;
    }
    EXPECT_LT(refused, tiles / 2);
    EXPECT_GT(sides, tiles);
    EXPECT_GE(outside, -0x1p-20);
    EXPECT_GT(hits, 50000u);
    // The sum is not a number while MMX registers are in use.
    volatile long double one = 1;
    EXPECT_EQ(one + one, 2);
}

TEST(StoredPackets, AreRefusedForRaysThatHaveNone) {
    const TestScene scene = icosphere(3);
    const Bvh bvh = build_bvh(scene.topology(), scene.positions());
    const cpu::PacketTracer packets(bvh, best_simd_target());
    Random random(72);
    const StoredTile good = random_tile(scene, Finish::kNone, random);
    const auto scratch = std::make_unique<Scratch>();
    const auto is_traced = [&](const StoredTile& tile) {
        return packets.intersect_stored(tile.view(), scratch->directions, scratch->packet,
                                        scratch->hits.data());
    };
    if (std::string_view(best_simd_target().name) == "scalar") {
        EXPECT_FALSE(is_traced(good));
        return;
    }
    EXPECT_TRUE(is_traced(good));
    constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
    const auto with = [&](auto change) {
        StoredTile tile = good;
        change(tile.rays[tile.rays.size() / 2 + 3]);
        return is_traced(tile);
    };
    EXPECT_TRUE(with([](StoredRay& ray) { ray.tnear = -1; }));
    EXPECT_FALSE(with([](StoredRay& ray) { ray.tnear = 1e-30f; }));
    EXPECT_FALSE(with([](StoredRay& ray) { ray.tnear = kNan; }));
    EXPECT_FALSE(with([](StoredRay& ray) { ray.tfar = 1e30f; }));
    EXPECT_FALSE(with([](StoredRay& ray) { ray.tfar = kNan; }));
    for (int axis = 0; axis < 3; ++axis) {
        EXPECT_FALSE(with([&](StoredRay& ray) { ray.org[axis] += 1; }));
        EXPECT_FALSE(with([&](StoredRay& ray) { ray.org[axis] = kNan; }));
        EXPECT_FALSE(with([&](StoredRay& ray) { ray.dir[axis] = kNan; }));
        EXPECT_FALSE(with([&](StoredRay& ray) { ray.dir[axis] = kInfinity; }));
    }
    EXPECT_FALSE(with([](StoredRay& ray) { ray.dir[0] = ray.dir[1] = ray.dir[2] = 0; }));
    EXPECT_FALSE(with([](StoredRay& ray) { ray.dir[0] = ray.dir[1] = ray.dir[2] = 1e-42f; }));
    EXPECT_FALSE(with([](StoredRay& ray) {
        for (float& d : ray.dir) d = -d;
    }));
    StoredTile other = good;
    for (StoredRay& ray : other.rays) {
        const vec3 d = random.point();
        std::memcpy(ray.dir, &d, sizeof ray.dir);
    }
    EXPECT_FALSE(is_traced(other));
    for (StoredRay& ray : other.rays) ray.dir[0] = ray.dir[1] = ray.dir[2] = 1;
    EXPECT_FALSE(is_traced(other));
}

}  // namespace
}  // namespace mray::test
