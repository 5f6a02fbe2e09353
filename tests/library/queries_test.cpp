// Closest and any hits through the public interface equal brute force.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/library/scenes.h"

namespace mray::test {
namespace {

using morphray::Device;
using morphray::Scene;

constexpr std::size_t kRays = 2000;

TEST(Queries, EqualBruteForceOnHardMeshes) {
    std::size_t hits = 0;
    for (const NamedScene& named : adversarial_scenes()) {
        const UserMesh mesh(named.scene);
        const std::vector<morphray::Ray> rays = world_rays(mesh, kRays, 3);
        const Scene brute = Scene::build(mesh.view(), Device::brute_force());
        const std::vector<morphray::Hit> expected = hits_of(brute, rays);
        hits += count_hits(expected);
        expect_same_hits(hits_of(Scene::build(mesh.view()), rays), expected, named.name);
    }
    EXPECT_GT(hits, 5000u);
}

/// Few rays are traced one by one, more of them in streams.
TEST(Queries, OfFewRaysAreThoseOfOneRayForEachInstructionSet) {
    const UserMesh mesh(torus(60, 40));
    const std::vector<morphray::Ray> rays = world_rays(mesh, 300, 8);
    std::vector<std::string> targets = morphray::simd_targets();
    targets.push_back("off");
    const morphray::Hit untouched{-1, -2, -3, 77, 88};
    for (const std::string& simd : targets) {
        const Scene scene = Scene::build(mesh.view(), Device::cpu({.threads = 2, .simd = simd}));
        for (std::size_t size = 0; size <= 70; ++size) {
            const auto some = std::span(rays).subspan(size, size);
            std::vector<morphray::Hit> hits(size + 1, untouched);
            std::vector<std::uint8_t> occluded(size + 1, 7);
            scene.intersect(some, std::span(hits).first(size));
            scene.occluded(some, std::span(occluded).first(size));
            for (std::size_t i = 0; i < size; ++i) {
                ASSERT_EQ(hits[i], scene.intersect(some[i])) << simd << ", " << size;
                ASSERT_EQ(occluded[i] != 0, scene.occluded(some[i])) << simd << ", " << size;
            }
            EXPECT_EQ(hits[size], untouched);
            EXPECT_EQ(occluded[size], 7);
        }
    }
}

/// Rays of images, whose sides and lengths are of all kinds, are traced in packets where they can.
TEST(Queries, OfImagesEqualBruteForce) {
    Random random(21);
    std::size_t hit_count = 0;
    for (const UserMesh& mesh : {UserMesh(torus(40, 20)), UserMesh(random_soup(500, 0.3, 5))}) {
        const Scene scene = Scene::build(mesh.view());
        const Scene brute = scene.on(Device::brute_force());
        const std::pair<int, int> sizes[] = {{3, 50},   {8, 9},   {16, 16}, {17, 40},
                                             {100, 75}, {64, 64}, {130, 20}};
        for (const auto& [width, height] : sizes) {
            std::vector<morphray::Ray> rays;
            const float turn = static_cast<float>(random.real(-0.3, 0.3));
            const int kind = static_cast<int>(random.below(4));
            for (int i = 0; i < width * height + 5; ++i) {
                const float x = (static_cast<float>(i % width) + 0.5f) / 80 - 0.6f;
                const float y = (static_cast<float>(i / width) + 0.5f) / 80 - 0.4f;
                const float length = kind == 1 ? static_cast<float>(random.real(0.2, 7)) : 1.0f;
                rays.push_back(
                    {.org = {0.3f, 0.2f, 3},
                     .dir = {length * (x + turn * y), length * (y - turn * x), -length}});
                // Some that are no rays of the image.
                if (kind == 2 && random.below(1000) == 0) rays.back().tfar = 2.5f;
                if (kind == 3 && random.below(1000) == 0) rays.back().dir = {1, 0, 0};
            }
            const std::vector<morphray::Hit> expected = hits_of(brute, rays);
            const auto coherence = morphray::Coherence::image(static_cast<std::size_t>(width));
            expect_same_hits(hits_of(scene, rays, coherence), expected, std::to_string(width));
            hit_count += count_hits(expected);
            std::vector<std::uint8_t> occluded(rays.size());
            scene.occluded(rays, std::span<std::uint8_t>(occluded), {coherence});
            for (std::size_t i = 0; i < rays.size(); ++i)
                ASSERT_EQ(occluded[i] != 0, bool{expected[i]}) << i;
        }
    }
    EXPECT_GT(hit_count, 3000u);
}

TEST(Queries, HitPointsAreOnTheTrianglesOfTheCaller) {
    const UserMesh mesh(torus(30, 20));
    const Scene scene = Scene::build(mesh.view());
    const std::vector<morphray::Ray> rays = world_rays(mesh, kRays, 6);
    const std::vector<morphray::Hit> hits = hits_of(scene, rays);
    EXPECT_GT(count_hits(hits), kRays / 3);
    for (std::size_t i = 0; i < hits.size(); ++i) {
        const morphray::Hit& hit = hits[i];
        if (!hit) continue;
        ASSERT_EQ(hit.geom_id, 0u);
        const auto corner = [&](std::size_t k) {
            const morphray::Vec3& p = mesh.points[mesh.triangles[3 * hit.prim_id + k]];
            return vec3(p.x, p.y, p.z);
        };
        const vec3 on_triangle =
            (1 - hit.u - hit.v) * corner(0) + hit.u * corner(1) + hit.v * corner(2);
        const morphray::Ray& r = rays[i];
        const vec3 on_ray(r.org.x + hit.t * r.dir.x, r.org.y + hit.t * r.dir.y,
                          r.org.z + hit.t * r.dir.z);
        for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(on_triangle[axis], on_ray[axis], 1e-4);
    }
}

TEST(Queries, RaysThatCannotHitAnythingHitNothing) {
    const UserMesh mesh(icosphere(2));
    const Scene scene = Scene::build(mesh.view());
    constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    const morphray::Ray good{{0, 0, 3}, 0, {0, 0, -1}, kInfinity};
    const std::vector<morphray::Ray> rays = {
        good,
        {{kNan, 0, 3}, 0, {0, 0, -1}, kInfinity},
        {{0, kInfinity, 3}, 0, {0, 0, -1}, kInfinity},
        {{0, 0, 3}, 0, {0, 0, 0}, kInfinity},
        {{0, 0, 3}, 0, {0, kNan, -1}, kInfinity},
        {{0, 0, 3}, 0, {0, 0, -kInfinity}, kInfinity},
        {{0, 0, 3}, 5, {0, 0, -1}, 4},
        {{0, 0, 3}, kNan, {0, 0, -1}, kInfinity},
        {{0, 0, 3}, 0, {0, 0, -1}, kNan},
        {{0, 0, 3}, -2, {0, 0, -1}, -1},
        {{0, 0, 1e30f}, 0, {0, 0, 1}, kInfinity},
        {{0, 3, 1e30f}, 0, {0, 0, -1}, kInfinity},
        {{0, 0, 1e30f}, 0, {0, 0, -1}, 9e29f},
        {{0, 0, 3}, -5, {0, 0, -1}, kInfinity},
    };
    const std::vector<morphray::Hit> hits = hits_of(scene, rays);
    EXPECT_TRUE(hits.front());
    EXPECT_EQ(hits.back(), hits.front());
    for (std::size_t i = 1; i + 1 < hits.size(); ++i) {
        EXPECT_EQ(hits[i], morphray::Hit{}) << i;
        EXPECT_EQ(scene.intersect(rays[i]), morphray::Hit{}) << i;
        EXPECT_FALSE(scene.occluded(rays[i])) << i;
    }
}

/// A ray's hit or miss by every way to ask for it, which must agree.
morphray::Hit hit_of(const Scene& scene, const morphray::Ray& ray) {
    const morphray::Hit hit = scene.intersect(ray);
    EXPECT_EQ(hits_of(scene, {ray})[0], hit);
    EXPECT_EQ(hits_of(scene, std::vector<morphray::Ray>(300, ray))[299], hit);
    EXPECT_EQ(scene.occluded(ray), bool{hit});
    std::uint8_t occluded = 2;
    scene.occluded({&ray, 1}, {&occluded, 1});
    EXPECT_EQ(occluded, hit ? 1 : 0);
    return hit;
}

/// Hits have t > 0 and tnear <= t <= tfar.
TEST(Queries, CountBothEndsOfARayButNotItsOrigin) {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    UserMesh mesh;
    mesh.points = {{-1, -1, 0}, {3, -1, 0}, {-1, 3, 0}, {-1, -1, -1}, {3, -1, -2}, {-1, 3, -1.5f}};
    mesh.triangles = {0, 1, 2, 3, 4, 5};
    const Scene built = Scene::build(mesh.view());
    const Scene brute = built.on(Device::brute_force());
    for (const Scene* const scene : {&built, &brute}) {
        // From within the first triangle, from an edge and from a corner: the second one is hit.
        for (const morphray::Vec3 on : {morphray::Vec3{0, 0, 0}, {1, -1, 0}, {-1, 3, 0}}) {
            const morphray::Vec3 down{-0.1f * on.x, -0.1f * on.y, -2};
            for (const float tnear : {0.0f, -0.0f, -1.0f, -kInfinity}) {
                EXPECT_EQ(hit_of(*scene, {on, tnear, {0.01f, 0.02f, 1}, kInfinity}),
                          morphray::Hit{});
                EXPECT_EQ(hit_of(*scene, {on, tnear, down, kInfinity}).prim_id, 1u);
                EXPECT_EQ(hit_of(*scene, {on, tnear, down, 0}), morphray::Hit{});
            }
        }
        const morphray::Ray from_above{{0.2f, 0.3f, 0.7f}, 0, {0.1f, -0.2f, -1.3f}, kInfinity};
        const morphray::Hit first = hit_of(*scene, from_above);
        ASSERT_EQ(first.prim_id, 0u);
        const auto between = [&](float tnear, float tfar) {
            return hit_of(*scene, {from_above.org, tnear, from_above.dir, tfar});
        };
        const float below = std::nextafter(first.t, 0.0f);
        const float above = std::nextafter(first.t, kInfinity);
        EXPECT_EQ(between(first.t, kInfinity), first);
        EXPECT_EQ(between(0, first.t), first);
        EXPECT_EQ(between(first.t, first.t), first);
        EXPECT_EQ(between(below, above), first);
        EXPECT_EQ(between(-1, above), first);
        EXPECT_EQ(between(0, below), morphray::Hit{});
        EXPECT_EQ(between(-first.t, 0), morphray::Hit{});
        const morphray::Hit second = between(above, kInfinity);
        EXPECT_EQ(second.prim_id, 1u);
        EXPECT_GT(second.t, first.t);
        EXPECT_EQ(between(above, below), morphray::Hit{});
    }
}

TEST(Queries, TrianglesWithoutAreaAreHitOnlyIfTheirCornersDiffer) {
    UserMesh mesh;
    mesh.points = {{-1, -0.75f, 0.25f}, {1, 0.75f, 0.75f}, {0, 0, 0.5f}, {0, 0, 0.5f}};
    Random random(32);
    std::vector<morphray::Ray> rays(20000);
    for (morphray::Ray& ray : rays) {
        const double at = random.real(-1, 1);
        ray.org = {static_cast<float>(random.real(-1, 1)), 0.2f, 3};
        ray.dir = {static_cast<float>(at - ray.org.x), static_cast<float>(0.75 * at - ray.org.y),
                   static_cast<float>(0.5 + 0.25 * at - ray.org.z)};
    }
    mesh.triangles = {0, 1, 2};
    EXPECT_GT(count_hits(hits_of(Scene::build(mesh.view()), rays)), 0u);
    for (const std::uint32_t corner : {0u, 2u}) {
        mesh.triangles = {corner, 2, 3};
        EXPECT_EQ(count_hits(hits_of(Scene::build(mesh.view()), rays)), 0u);
    }
}

TEST(Compare, NamesTheFirstHitsThatDiffer) {
    UserMesh mesh(icosphere(2));
    const Scene scene = Scene::build(mesh.view());
    UserMesh other = mesh;
    for (morphray::Vec3& p : other.points) p.z *= 0.5f;
    const Scene changed = Scene::build(other.view());
    const std::vector<morphray::Ray> rays = world_rays(mesh, 500, 9);
    EXPECT_TRUE(morphray::compare(scene, scene, rays).equal());
    const morphray::Comparison comparison = morphray::compare(scene, changed, rays, 3);
    EXPECT_FALSE(comparison.equal());
    EXPECT_EQ(comparison.compared, 500u);
    EXPECT_EQ(comparison.differences.size(), 3u);
    EXPECT_NE(morphray::describe(comparison).find(" of 500 differ\n"), std::string::npos);
    EXPECT_EQ(comparison.differences[0].first,
              scene.intersect(rays[comparison.differences[0].index]));
}

}  // namespace
}  // namespace mray::test
