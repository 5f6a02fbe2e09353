// Packets give the answers of single rays: camera packets, packets of rays that a caller has
// stored, and light packets, also where their plane serves them badly.
#include "cpu/packet/packet_tracer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/base/errors.h"
#include "common/bvh/builder/bvh_builder.h"
#include "common/interop/camera.h"
#include "common/scene/camera_setup.h"
#include "cpu/reference/scalar_tracer.h"
#include "tests/support/same_bits.h"
#include "tests/support/test_scene.h"

namespace mray {
namespace {

using namespace test;

/// The least n.d / |d| of a packet's wedge sides n and a ray's direction d, with the sum of
/// magnitudes for |d|; 0 if it is positive. A wedge that holds the ray has no less than what
/// roundings make of 0.
double least_inside_wedges(const cpu::PacketFrame& frame, const vec3& dir) {
    double least = 0;
    double size = 0;
    for (int axis = 0; axis < 3; ++axis) size += std::abs(double{dir[axis]});
    for (std::uint32_t k = 0; k < frame.wedge_side_count; ++k) {
        const cpu::WedgeSide& side = frame.wedge_sides[k];
        double inside = 0;
        for (int i = 0; i < 2; ++i)
            inside += double{side.normal[i]} * dir[static_cast<int>(side.axes[i])];
        least = std::min(least, inside / size);
    }
    return least;
}

/// Long triangles that reach past `place`: in turn thin ones near it, and wide ones whose planes
/// nearly hold it.
TestScene triangles_past(const vec3& place, std::uint64_t seed) {
    Random random(seed);
    std::vector<vec3> positions;
    std::vector<uvec3> triangles;
    const auto power = [&](int most, std::uint32_t count) {
        return std::ldexp(1.0, most - static_cast<int>(random.below(count)));
    };
    for (std::uint32_t i = 0; i < 6; ++i) {
        const bool is_thin = i % 2 == 0;
        const vec3 a = random.point();
        const vec3 beyond = (place - a) * static_cast<float>(random.real(0.2, 1));
        const double distance = is_thin ? power(-1, 6) : power(-16, 10);
        const double width = is_thin ? distance * power(-3, 10) : power(-1, 6);
        const vec3 c = place + beyond + random.point(distance);
        positions.insert(positions.end(), {a, a + random.point(width), c});
        triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    }
    return TestScene(positions, triangles);
}

// ---- Camera packets

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

/// Views from outside, from inside, from a vertex, from the middle of an edge, wide and narrow.
std::vector<ViewSpec> views(const TestScene& scene, std::uint64_t seed) {
    Random random(seed);
    const WorldBounds bounds = bounds_of(scene.world_positions());
    const auto inside = [&] {
        dvec3 p(0);
        for (int axis = 0; axis < 3; ++axis)
            p[axis] = random.real(bounds.lower[axis], bounds.upper[axis]);
        return to_point(p);
    };
    const auto finite_vertex = [&]() -> vec3 {
        for (int i = 0; i < 100; ++i) {
            const vec3 p = random.pick(scene.world_positions());
            if (std::isfinite(p.x + p.y + p.z)) return p;
        }
        return vec3(0, 0, 0);
    };
    std::vector<ViewSpec> all = {{.width = 45, .height = 37}};
    if (bounds.empty() || scene.positions().empty()) return all;
    for (int i = 0; i < 5; ++i) {
        ViewSpec view{.width = i % 2 == 0 ? 33u : 128u, .height = i % 2 == 0 ? 70u : 64u};
        const dvec3 a = finite_vertex();
        const dvec3 b = finite_vertex();
        const Point eyes[] = {inside(), to_point(a), to_point((a + b) / 2.0), inside(), inside()};
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
        ViewSpec view{.width = 64, .height = 64};
        const vec3 target = eye + random.point();
        view.eye = to_point(eye);
        view.target = to_point(target);
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

// ---- Stored packets

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
    return scene.positions().empty() ? vec3(0) : random.pick(scene.positions());
}

vec3 normalised(vec3 v) {
    const double length = glm::length(dvec3(v));
    return length > 0 ? vec3(dvec3(v) / length) : vec3(0, 0, 1);
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
    tile.org = snap_point(from + jitter);
    const vec3 forward = normalised(at - tile.org);
    const vec3 right = normalised(glm::cross(forward, normalised(random.point())));
    const vec3 down = glm::cross(forward, right);
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
            vec3 d = forward + right * px + down * py;
            if (finish == Finish::kNormalised) d = normalised(d);
            if (finish == Finish::kAnyLength)
                d *= std::ldexp(static_cast<float>(random.real(0.1, 9)), random.from(-20, 19));
            tile.rays.push_back(
                {{tile.org.x, tile.org.y, tile.org.z}, 0, {d.x, d.y, d.z}, kInfinity});
        }
    }
    return tile;
}

struct Scratch {
    cpu::CameraPacket packet;
    cpu::StoredDirections directions;
    std::array<Hit, cpu::kCameraSide * cpu::kCameraSide> hits;
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
                        different += !same_bits(expected, scratch->hits[y * cpu::kCameraSide + x]);
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

// ---- Light packets

/// Blocks of the active rays; the others are absent.
std::vector<cpu::SharedOriginRays> blocks_of(std::span<const Ray> rays,
                                             std::span<const std::uint8_t> active) {
    std::vector<cpu::SharedOriginRays> blocks(rays.size() / cpu::kBlockRays,
                                              cpu::SharedOriginRays::none());
    for (std::size_t i = 0; i < rays.size(); ++i)
        if (active[i] != 0) blocks[i / cpu::kBlockRays].set(i % cpu::kBlockRays, rays[i]);
    return blocks;
}

/// The ray from org to somewhere between target / 2 and target, times `reach`.
Ray ray_towards(vec3 org, vec3 target, float reach) {
    const vec3 way = snap_point(target) - org;
    return {org, 0, canonical_direction(way), power_of_two_below(largest_component(way)) * reach};
}

/// Tells how many rays a packet left to others, and how many of the rest are occluded.
struct PacketAnswers {
    std::size_t fallback = 0;
    std::size_t dark = 0;
};

class LightPackets : public testing::TestWithParam<SimdTarget> {
protected:
    /// Expects of all rays but fallback rays what brute force says.
    PacketAnswers check(const TestScene& scene, std::span<const Ray> rays,
                        std::span<const std::uint8_t> active) {
        const Bvh bvh = build_bvh(scene.topology(), scene.positions());
        const cpu::PacketTracer tracer(bvh, GetParam());
        const cpu::BruteTracer brute(scene.topology(), scene.positions());
        std::vector<std::uint8_t> occluded(rays.size(), 9);
        std::vector<std::uint16_t> fallback(rays.size());
        fallback.resize(tracer.occluded_shared_origin(rays[0].org, blocks_of(rays, active),
                                                      *packet_, occluded.data(), fallback.data()));
        std::vector<std::uint8_t> is_fallback(rays.size());
        for (const std::uint16_t ray : fallback) {
            EXPECT_TRUE(active[ray] != 0 && is_fallback[ray] == 0);
            is_fallback[ray] = 1;
        }
        PacketAnswers answers{fallback.size(), 0};
        std::size_t wrong = 0;
        for (std::size_t i = 0; i < rays.size(); ++i) {
            if (is_fallback[i] != 0) continue;
            const int expected = active[i] == 0 || brute.occluded(rays[i]) ? 1 : 0;
            wrong += occluded[i] != expected;
            answers.dark += active[i] != 0 && expected != 0;
        }
        EXPECT_EQ(wrong, 0u);
        return answers;
    }

    std::unique_ptr<cpu::LightPacket> packet_ = std::make_unique<cpu::LightPacket>();
};

TEST_P(LightPackets, HaveWedgesThatHoldAllRays) {
    std::uint32_t sides = 0;
    for (std::uint64_t seed = 0; seed < 40; ++seed) {
        Random random(seed);
        const TestScene scene = random_soup(20, 0.3, seed);
        const vec3 org = snap_point(random.point(0.3 * kSceneExtent));
        vec3 middle = org + random.point(0.4 * kSceneExtent);
        middle[static_cast<int>(seed % 3)] += (seed % 2 == 0 ? 1 : -1) * kSceneExtent;
        // Some blocks are so wide that they are regrouped.
        const double spread = static_cast<double>(seed % 4 + 1) * 0.1 * kSceneExtent;
        std::vector<Ray> rays;
        for (std::size_t i = 0; i < cpu::kSquareRays; ++i) {
            const double own = i % 64 < 16 ? spread : 0.3 * spread;
            rays.push_back(ray_towards(org, middle + random.point(own), 2));
        }
        const std::vector<std::uint8_t> all(rays.size(), 1);
        EXPECT_EQ(check(scene, rays, all).fallback, 0u);
        EXPECT_GT(packet_->regrouped_count, 0u);
        const cpu::PacketFrame& frame = packet_->frame;
        for (const Ray& ray : rays)
            EXPECT_GE(least_inside_wedges(frame, ray.dir), -0x1p-23) << "seed " << seed;
        sides += frame.wedge_side_count;
    }
    EXPECT_GT(sides, 40u);
}

TEST_P(LightPackets, TraceRaysInAllDirectionsByFaces) {
    for (std::uint64_t seed = 0; seed < 4; ++seed) {
        Random random(seed);
        const TestScene scene = random_soup(200, 0.3, seed);
        const vec3 org = snap_point(random.point(0.3 * kSceneExtent));
        const std::size_t count = cpu::kSquareRays * (4 - seed);
        std::vector<Ray> rays;
        for (std::size_t i = 0; i < count; ++i)
            rays.push_back(ray_towards(org, org + random.point(kSceneExtent), 2));
        const PacketAnswers all = check(scene, rays, std::vector<std::uint8_t>(count, 1));
        EXPECT_EQ(all.fallback, 0u);
        EXPECT_GT(all.dark, count / 20);
        EXPECT_LT(all.dark, count);
        std::vector<std::uint8_t> some(count);
        for (std::size_t i = 0; i < count; ++i)
            some[i] = i % 5 == 0 || rays[i].dir.x > std::abs(rays[i].dir.y);
        EXPECT_LT(check(scene, rays, some).fallback, count / 4);
    }
}

TEST_P(LightPackets, LeaveAFewRaysInAllDirectionsToOthers) {
    Random random(7);
    const TestScene scene = random_soup(50, 0.3, 7);
    std::vector<Ray> rays;
    std::vector<std::uint8_t> active(cpu::kSquareRays);
    for (std::size_t i = 0; i < active.size(); ++i) {
        rays.push_back(ray_towards({0, 0, 0}, random.point(kSceneExtent), 1));
        active[i] = i % 32 == 3;
    }
    EXPECT_EQ(check(scene, rays, active).fallback, active.size() / 32);
    EXPECT_EQ(check(scene, rays, std::vector<std::uint8_t>(rays.size(), 0)).fallback, 0u);
}

/// Rays towards one side of `org`: a third anywhere in a cone, the others at triangles.
std::vector<Ray> rays_at(const TestScene& scene, vec3 org, std::uint64_t seed) {
    Random random(seed);
    const vec3 towards = org + random.point(kSceneExtent);
    const double spread = std::ldexp(kSceneExtent, -static_cast<int>(seed % 6));
    std::vector<Ray> rays;
    for (std::uint32_t i = 0; i < cpu::kSquareRays; ++i) {
        vec3 target = towards + random.point(spread);
        if (i % 3 != 0) {
            const vec3* const corner =
                &scene.positions()[random.pick(scene.topology().triangles).x];
            const auto u = static_cast<float>(random.real(0, 1));
            const auto v = static_cast<float>(random.real(0, 1 - u));
            target = corner[0] + (corner[1] - corner[0]) * u + (corner[2] - corner[0]) * v;
        }
        const bool is_there = dot3(target - org, towards - org) > 0;
        rays.push_back(ray_towards(org, is_there ? target : towards, i % 2 == 0 ? 2 : 8));
    }
    return rays;
}

/// Ends rays at what they hit, moved by 2^-12 to 2^-24 of the way to either side.
void end_at_hits(const TestScene& scene, Random& random, std::vector<Ray>& rays) {
    const cpu::BruteTracer brute(scene.topology(), scene.positions());
    for (Ray& ray : rays) {
        ray.tfar = kInfiniteT;
        const Hit hit = brute.intersect(ray);
        const float side = random.below(4) == 0 ? 1.0f : -1.0f;
        const float step = std::ldexp(side, -12 - static_cast<int>(random.below(13)));
        ray.tfar = hit.prim_id == kNoPrim ? 2 * kSceneExtent : hit.t * (1 + step);
    }
}

TEST_P(LightPackets, AnswerLikeBruteForceAmongTrianglesThatReachPastTheLight) {
    for (const bool at_surfaces : {false, true}) {
        PacketAnswers sum;
        const std::uint64_t seeds = at_surfaces ? 60 : 300;
        for (std::uint64_t seed = 0; seed < seeds; ++seed) {
            Random random(seed);
            const vec3 light = random.point(0.3);
            const TestScene scene = at_surfaces && seed % 2 != 0
                                        ? random_soup(12, seed % 4 == 1 ? 4 : 0.5, seed)
                                        : triangles_past(light, seed);
            const vec3 org = snap_point(scene.space().to_scene(light));
            std::vector<Ray> rays = rays_at(scene, org, seed);
            if (at_surfaces) end_at_hits(scene, random, rays);
            const PacketAnswers own = check(scene, rays, std::vector<std::uint8_t>(rays.size(), 1));
            sum.dark += own.dark;
            sum.fallback += own.fallback;
        }
        const std::size_t count = seeds * cpu::kSquareRays;
        EXPECT_LT(sum.fallback, count / 10);
        EXPECT_GT(sum.dark, count / (at_surfaces ? 20 : 10));
        EXPECT_LT(sum.dark, at_surfaces ? count / 2 : count - count / 10);
    }
}

TEST_P(LightPackets, AnswerLikeBruteForceForFullPartialAndEmptyMasksOnEveryScene) {
    std::size_t decided = 0;
    for (const NamedScene& named : adversarial_scenes()) {
        for (std::uint64_t seed = 0; seed < 12; ++seed) {
            SCOPED_TRACE(named.name + ", seed " + std::to_string(seed));
            Random random(seed);
            const vec3 org = snap_point(random.point((seed % 3 == 0 ? 0.5 : 3) * kSceneExtent));
            const vec3 towards = random.point(kSceneExtent);
            const double spread = std::ldexp(kSceneExtent, -static_cast<int>(random.below(16)));
            std::vector<Ray> rays;
            std::vector<std::uint8_t> active;
            const std::size_t count = cpu::kSquareRays * (4 - seed % 4);
            for (std::size_t i = 0; i < count; ++i) {
                const vec3 target = towards + random.point(spread);
                rays.push_back(ray_towards(org, target, seed % 2 == 0 ? 1 : 4));
                active.push_back(seed == 3 ? 0 : seed == 4 ? i % 5 == 0 : seed == 5 ? i == 700 : 1);
            }
            decided += count - check(named.scene, rays, active).fallback;
        }
    }
    EXPECT_GT(decided, 100u * cpu::kSquareRays);
}

INSTANTIATE_TEST_SUITE_P(Packets, LightPackets, testing::ValuesIn(supported_simd_targets()),
                         [](const auto& target) { return std::string(target.param.name); });

}  // namespace
}  // namespace mray
