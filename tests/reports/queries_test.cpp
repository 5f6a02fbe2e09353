// Rays and points of reports by users of other tools, on each device that answers. Expected values
// come from rational arithmetic on the floats given.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <string>
#include <tuple>
#include <vector>

#include "tests/library/scenes.h"

namespace mray::test {
namespace {

using morphray::ClosestPoint;
using morphray::Crossing;
using morphray::FillRule;
using morphray::Hit;
using morphray::Ray;
using morphray::Scene;
using morphray::Vec3;

/// Reports are named by their project and number there.
class Reports : public ::testing::TestWithParam<const char*> {
protected:
    void SetUp() override {
        if (GetParam() == std::string("vulkan") && !has_vulkan()) GTEST_SKIP() << "no device";
    }

    Scene build(const UserMesh& mesh) const { return build(std::vector{mesh}); }
    /// The meshes must outlive the scene.
    Scene build(const std::vector<UserMesh>& meshes) const {
        return Scene::build(views_of(meshes, false), device());
    }

private:
    static bool has_vulkan() {
        try {
            morphray::Device::vulkan();
            return true;
        } catch (const morphray::Error&) {
            return false;
        }
    }
    morphray::Device device() const {
        const std::string name = GetParam();
        if (name == "brute") return morphray::Device::brute_force();
        if (name == "vulkan") return morphray::Device::vulkan();
        return morphray::Device::cpu({.simd = name == "off" ? "off" : ""});
    }
};

/// A ray from `org` along `dir`.
Ray ray(Vec3 org, Vec3 dir) { return {.org = org, .dir = dir}; }

::testing::AssertionResult is_within_an_ulp(float value, double exact) {
    const auto nearest = static_cast<float>(exact);
    if (value >= std::nextafter(nearest, -INFINITY) && value <= std::nextafter(nearest, INFINITY))
        return ::testing::AssertionSuccess();
    return ::testing::AssertionFailure() << value << " instead of " << exact;
}

/// All hits of a ray, nearest first.
std::vector<Hit> all_hits(const Scene& scene, const Ray& ray, Crossing crossing) {
    return scene.intersect_all(std::span(&ray, 1), {.crossing = crossing}).hits;
}

/// A box, counter-clockwise as seen from outside; corner i has the upper x, y, z of its bits.
UserMesh box(Vec3 lower, Vec3 upper) {
    UserMesh mesh;
    for (int i = 0; i < 8; ++i) {
        mesh.points.push_back({(i & 1) != 0 ? upper.x : lower.x, (i & 2) != 0 ? upper.y : lower.y,
                               (i & 4) != 0 ? upper.z : lower.z});
    }
    mesh.triangles = {0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4,
                      2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5};
    return mesh;
}

UserMesh tetrahedron() { return UserMesh(TestScene(shapes::tetrahedron())); }

/// A square [lower, upper] x [lower, upper] of two triangles at z = 0.
UserMesh square(float lower, float upper) {
    UserMesh mesh;
    mesh.points = {{lower, lower, 0}, {upper, lower, 0}, {upper, upper, 0}, {lower, upper, 0}};
    mesh.triangles = {0, 1, 2, 0, 2, 3};
    return mesh;
}

/// (0, 0, 0), (side, 0, 0), (0, side, 0).
UserMesh triangle(float side) {
    UserMesh mesh;
    mesh.points = {{0, 0, 0}, {side, 0, 0}, {0, side, 0}};
    mesh.triangles = {0, 1, 2};
    return mesh;
}

TEST_P(Reports, Oblikovati2146AQuadIsHitOnItsDiagonal) {
    const Scene scene = build(square(-5, 5));
    const Ray diagonal = ray({0, 0, 10}, {0.30458447f, 0.30458447f, -0.9024725f});
    const Hit hit = scene.intersect(diagonal);
    EXPECT_EQ(hit.prim_id, 0u);
    EXPECT_TRUE(is_within_an_ulp(hit.t, 11.080670096828632));
    EXPECT_EQ(all_hits(scene, diagonal, Crossing::each).size(), 2u);
    EXPECT_EQ(all_hits(scene, diagonal, Crossing::owner).size(), 1u);
}

TEST_P(Reports, Tinybvh283SmallTrianglesAreHit) {
    for (const auto& [size, distance] :
         {std::pair(2e-4f, 1.0f), {1e-6f, 1e-3f}, {1e-12f, 1e-9f}, {1e-20f, 1e-17f}}) {
        const Hit hit =
            build(triangle(size)).intersect(ray({size / 3, size / 3, -distance}, {0, 0, 1}));
        EXPECT_EQ(hit.prim_id, 0u) << size;
        EXPECT_TRUE(is_within_an_ulp(hit.t, distance)) << size;
    }
}

TEST_P(Reports, Amrex5789ALongSegmentBesideATriangleMisses) {
    const Scene scene = build(triangle(1));
    for (const float far : {1e9f, 1e5f})
        EXPECT_FALSE(scene.intersect(ray({0.75f, 0.75f, -far}, {0, 0, 2 * far}))) << far;
}

TEST_P(Reports, ThreeMeshBvh684ARayThroughAnEdgeHitsIt) {
    UserMesh mesh;
    mesh.points = {{-1.3836679458618164f, -4.480311870574951f, 10},
                   {3.9273109436035156f, 5.897944450378418f, 8},
                   {-1.3836679458618164f, -4.480311870574951f, 8}};
    mesh.triangles = {0, 1, 2};
    const Scene scene = build(mesh);
    for (const auto& [shift, t] : {std::pair(-0.001, 0.5135076224051648),
                                   {0.0, 0.5127472330424204},
                                   {0.001, 0.511986843679676}}) {
        const Hit hit = scene.intersect(
            ray({-0.028221702575683627f, static_cast<float>(-2.5058889150619503 + shift), 8},
                {-0.16852837373762f, 0.9856968028990217f, 0}));
        EXPECT_EQ(hit.prim_id, 0u) << shift;
        EXPECT_NEAR(hit.t, t, 1e-6) << shift;
    }
}

/// The triangles of a height map that contain (x, y), edges included; halves are exact in floats.
std::size_t triangles_at(const UserMesh& map, float x, float y) {
    std::size_t count = 0;
    for (std::size_t i = 0; i < map.triangles.size(); i += 3) {
        bool is_within = true;
        for (std::size_t k = 0; k < 3; ++k) {
            const Vec3 a = map.points[map.triangles[i + k]];
            const Vec3 b = map.points[map.triangles[i + (k + 1) % 3]];
            is_within = is_within && (b.x - a.x) * (y - a.y) >= (b.y - a.y) * (x - a.x);
        }
        count += is_within;
    }
    return count;
}

TEST_P(Reports, ThreeMeshBvh169AndRapier165AllHitsOfAHeightMapHaveEachCrossingOnce) {
    constexpr std::uint32_t kSide = 9;
    const UserMesh map(
        TestScene(shapes::height_map(kSide - 1, kSide - 1, [](std::uint32_t x, std::uint32_t y) {
            const std::uint32_t i = y * kSide + x;
            return i * i % 5;
        })));
    const Scene scene = build(map);
    std::vector<Ray> rays;
    // At vertices, at the middles of edges and diagonals.
    for (std::uint32_t i = 0; i < 4 * kSide * kSide; ++i) {
        const float x = static_cast<float>(i % (2 * kSide)) / 2;
        const float y = static_cast<float>(i / (2 * kSide)) / 2;
        if (x <= kSide - 1 && y <= kSide - 1) rays.push_back(ray({x, y, 8}, {0, 0, -1}));
    }
    std::vector<std::uint64_t> counts(rays.size());
    scene.count(rays, counts);
    for (std::size_t i = 0; i < rays.size(); ++i) {
        const std::vector<Hit> hits = all_hits(scene, rays[i], Crossing::once);
        ASSERT_EQ(hits.size(), 1u) << rays[i].org.x << ' ' << rays[i].org.y;
        EXPECT_EQ(hits[0], scene.intersect(rays[i]));
        EXPECT_EQ(counts[i], 1u);
        const auto [x, y, z] = rays[i].org;
        const auto height = [&](float column, float row) {
            return map.points[static_cast<std::size_t>(row * kSide + column)].z;
        };
        const float sum = height(std::floor(x), std::floor(y)) + height(std::ceil(x), std::ceil(y));
        // In the middle of a cell it depends on its diagonal.
        if (x == std::floor(x) || y == std::floor(y)) {
            EXPECT_TRUE(is_within_an_ulp(hits[0].t, 8 - 0.5 * sum));
        }
        EXPECT_FALSE(scene.intersect(rays[i], hits[0], Crossing::once));
        EXPECT_EQ(all_hits(scene, rays[i], Crossing::each).size(),
                  triangles_at(map, rays[i].org.x, rays[i].org.y));
    }
}

TEST_P(Reports, Pyvista8698ThePoleOfASphereIsCrossedWhateverTheEnd) {
    // Around each pole ten triangles.
    constexpr std::uint32_t kSides = 10;
    UserMesh sphere;
    sphere.points = {{0, 0, 0.5f}, {0, 0, -0.5f}};
    for (std::uint32_t i = 0; i < kSides; ++i) {
        const double around = 2 * std::numbers::pi * i / kSides;
        sphere.points.push_back({static_cast<float>(0.5 * std::cos(around)),
                                 static_cast<float>(0.5 * std::sin(around)), 0});
        const std::uint32_t a = 2 + i;
        const std::uint32_t b = 2 + (i + 1) % kSides;
        sphere.triangles.insert(sphere.triangles.end(), {0, a, b, 1, b, a});
    }
    const Scene scene = build(sphere);
    for (const float end : {6.68732940059620f, 6.68732940059621f, 7.0f}) {
        Ray down = ray({0, 0, 5}, {0, 0, -1});
        down.tfar = end;
        const std::vector<Hit> hits = all_hits(scene, down, Crossing::owner);
        ASSERT_EQ(hits.size(), 2u) << end;
        EXPECT_TRUE(is_within_an_ulp(hits[0].t, 4.5));
        EXPECT_TRUE(is_within_an_ulp(hits[1].t, 5.5));
        EXPECT_EQ(all_hits(scene, down, Crossing::each).size(), 20u);
    }
}

TEST_P(Reports, Pyvista4842AndLibigl2026FacesAreCrossedOnceOnTheirDiagonals) {
    for (const auto& [mesh, through, in, out] :
         {std::tuple(box({0, 0, 0}, {10, 10, 6}), ray({5, 2, -10}, {0, 0, 1}), 10.0, 16.0),
          {box({-0.5f, -0.5f, -0.5f}, {0.5f, 0.5f, 0.5f}), ray({1, 0.1f, 0.1f}, {-1, 0, 0}), 0.5,
           1.5}}) {
        const std::vector<Hit> hits = all_hits(build(mesh), through, Crossing::owner);
        ASSERT_EQ(hits.size(), 2u);
        EXPECT_TRUE(is_within_an_ulp(hits[0].t, in));
        EXPECT_TRUE(is_within_an_ulp(hits[1].t, out));
    }
}

TEST_P(Reports, ThreeMeshBvh112AMoveThatIsExactKeepsHits) {
    const UserMesh mesh = box({0, 0, 0}, {256, 256, 128});
    UserMesh moved = mesh;
    constexpr float kMove = 98304;
    for (Vec3& p : moved.points) p = {p.x + kMove, p.y + kMove, p.z};
    const Scene scene = build(mesh);
    const Scene far = build(moved);
    for (float x = 0; x <= 256; x += 32) {
        const Ray near = ray({x, 96, 500}, {0, 0, -1});
        const Ray there = ray({x + kMove, 96 + kMove, 500}, {0, 0, -1});
        EXPECT_TRUE(scene.intersect(near)) << x;
        EXPECT_EQ(scene.intersect(near).prim_id, far.intersect(there).prim_id) << x;
        EXPECT_EQ(all_hits(scene, near, Crossing::each).size(),
                  all_hits(far, there, Crossing::each).size())
            << x;
    }
}

TEST_P(Reports, PythonEmbree20ARayFromAnywhereFindsWhatItHits) {
    UserMesh below = triangle(1);
    for (Vec3& p : below.points) p.z = -1;
    const Scene scene = build(std::vector{triangle(1), below});
    Random random(20);
    for (int i = 0; i < 100; ++i) {
        constexpr float kFar[] = {1e3f, 1000.1f, 2e3f, 1e6f, 1e9f, 1e20f, 3e38f};
        const float far = kFar[i % 7];
        const auto x = static_cast<float>(random.real(0.1, 0.4));
        const auto y = static_cast<float>(random.real(0.1, 0.4));
        const std::vector<Ray> rays = {
            ray({x, y, far}, {0, 0, -1}), ray({x, y, far}, {0, 0, -2 * far}),
            ray({x, y, far}, {0, 0, 1}), ray({0.75f, 0.75f, far}, {0, 0, -1}),
            ray({-far, y, 0.5f}, {1, 0, 0})};
        const std::vector<Hit> hits = hits_of(scene, rays);
        EXPECT_EQ(hits[0].t, far);
        EXPECT_EQ(hits[0].geom_id, 0u);
        EXPECT_EQ(bool{hits[1]}, 2 * far < INFINITY);
        if (hits[1]) {
            EXPECT_EQ(hits[1].t, 0.5f);
        }
        for (std::size_t k : {2, 3, 4}) EXPECT_FALSE(hits[k]) << far << ' ' << k;
        // The ray goes on after the first hit, and both t are one from far away.
        const std::vector<Hit> all = all_hits(scene, rays[0], Crossing::each);
        ASSERT_EQ(all.size(), 2u) << far;
        EXPECT_EQ(all[0], hits[0]);
        const Hit second = scene.intersect(rays[0], all[0]);
        EXPECT_EQ(second, all[1]) << far;
        EXPECT_EQ(second.geom_id, 1u);
        EXPECT_FALSE(scene.intersect(rays[0], second)) << far;
        // Both ends belong to the ray.
        Ray up_to = rays[0];
        up_to.tfar = far;
        EXPECT_EQ(scene.intersect(up_to), hits[0]) << far;
        up_to.tfar = 0.75f * far;
        EXPECT_FALSE(scene.intersect(up_to)) << far;
        Ray from = rays[0];
        from.tnear = far;
        EXPECT_EQ(scene.intersect(from).t, far);
    }
}

/// The hits after the first vertex has moved.
std::vector<Hit> hits_with_vertex_at(Scene& scene, UserMesh& mesh, Vec3 place,
                                     const std::vector<Ray>& rays) {
    mesh.points.front() = place;
    scene.update(0, morphray::packed(mesh.points));
    return hits_of(scene, rays);
}

TEST_P(Reports, DevilRay62AndOpensimCreator976AnExplodedVertexHidesNothingElse) {
    UserMesh mesh(torus(24, 12));
    const Vec3 rest = mesh.points.front();
    const std::vector<Ray> rays = world_rays(mesh, 300, 62);
    Scene scene = build(mesh);
    const std::vector<Hit> sound = hits_of(scene, rays);
    EXPECT_TRUE(scene.last_update().left_out.empty());
    constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
    const std::vector<Hit> without = hits_with_vertex_at(scene, mesh, {kNan, 0, 0}, rays);
    ASSERT_EQ(scene.last_update().left_out.size(), 1u);
    EXPECT_EQ(scene.last_update().left_out[0].not_finite, 1u);
    for (const Vec3 far : {Vec3{1e20f, -1e20f, 1e20f}, Vec3{0, 3e38f, 0}, Vec3{0, 0, -1e12f}}) {
        expect_same_hits(hits_with_vertex_at(scene, mesh, far, rays), without, "far");
        ASSERT_EQ(scene.last_update().left_out.size(), 1u);
        EXPECT_EQ(scene.last_update().left_out[0].too_far, 1u);
        EXPECT_LT(scene.bounds().upper[0], 10);
        const Scene fresh = build(mesh);
        expect_same_hits(hits_of(fresh, rays), hits_of(scene, rays), "fresh");
        EXPECT_EQ(fresh.edge_counts().open, 6u);
    }
    UserMesh nowhere = mesh;
    for (Vec3& p : nowhere.points) p.z = kNan;
    scene.update(0, morphray::packed(nowhere.points));
    EXPECT_EQ(count_hits(hits_of(scene, rays)), 0u);
    EXPECT_GT(scene.bounds().lower[0], scene.bounds().upper[0]);
    expect_same_hits(hits_with_vertex_at(scene, mesh, rest, rays), sound, "back");
    EXPECT_TRUE(scene.last_update().left_out.empty());
    // A body may leave the scene for good, as long as floats have room for both.
    hits_with_vertex_at(scene, mesh, {0, 1e8f, 0}, rays);
    EXPECT_TRUE(scene.last_update().left_out.empty());
    EXPECT_GT(scene.bounds().upper[1], 9e7);
}

TEST_P(Reports, AFarVertexThatNoTriangleUsesChangesNoBit) {
    const UserMesh mesh(torus(24, 12));
    const std::vector<Ray> rays = world_rays(mesh, 300, 60);
    const std::vector<Hit> expected = hits_of(build(mesh), rays);
    for (const std::size_t place : {std::size_t{0}, std::size_t{100}, mesh.points.size()}) {
        UserMesh stray = mesh;
        stray.points.insert(stray.points.begin() + static_cast<std::ptrdiff_t>(place),
                            Vec3{9.96921e36f, -1e20f, 0});
        for (std::uint32_t& vertex : stray.triangles) vertex += vertex >= place;
        const Scene scene = build(stray);
        expect_same_hits(hits_of(scene, rays), expected, std::to_string(place));
        EXPECT_TRUE(scene.last_update().left_out.empty());
        EXPECT_LT(scene.bounds().upper[0], 10);
    }
}

TEST_P(Reports, AMeshFarAwayHidesNoOther) {
    const std::vector<Ray> rays = {ray({0.25f, 0.25f, 1}, {0, 0, -1})};
    const std::vector<Hit> expected = hits_of(build(triangle(1)), rays);
    for (const float far : {1e18f, 1e20f, 1e37f}) {
        UserMesh away = triangle(1);
        for (Vec3& p : away.points) p = {p.x + far, p.y + far, p.z};
        const UserMesh large(torus(24, 12));
        UserMesh large_away = large;
        for (Vec3& p : large_away.points) p.x += far;
        for (const auto& [meshes, near] : {std::pair(std::vector{triangle(1), away}, 0u),
                                           {std::vector{away, triangle(1)}, 1u},
                                           {std::vector{triangle(1), large_away}, 0u}}) {
            const Scene scene = build(meshes);
            EXPECT_EQ(scene.intersect(rays[0]).t, expected[0].t) << far;
            EXPECT_EQ(scene.intersect(rays[0]).geom_id, near);
            ASSERT_EQ(scene.last_update().left_out.size(), 1u);
            EXPECT_EQ(scene.last_update().left_out[0].geom_id, 1 - near);
            EXPECT_EQ(scene.last_update().left_out[0].too_far, meshes[1 - near].points.size());
        }
        // A pose, and a mesh that comes later.
        Scene scene = build({triangle(1), large});
        morphray::Transform thrown;
        thrown.rows[0][3] = far;
        EXPECT_EQ(scene.update(1, thrown).left_out.size(), 1u);
        EXPECT_EQ(hits_of(scene, rays), expected) << far;
        scene.attach(large_away.view(false));
        EXPECT_EQ(scene.update().left_out.size(), 2u);
        EXPECT_EQ(hits_of(scene, rays), expected) << far;
    }
    // Near enough for both.
    UserMesh away = triangle(1);
    for (Vec3& p : away.points) p.x += 1e15f;
    const Scene both = build({triangle(1), away});
    EXPECT_EQ(hits_of(both, rays), expected);
    EXPECT_TRUE(both.last_update().left_out.empty());
}

TEST_P(Reports, ATriangleThatIsTooSmallIsTold) {
    for (const auto& [side, count] : {std::pair(0x1p-56f, 0u), {0x1p-60f, 1u}, {0x1p-100f, 1u}}) {
        UserMesh mesh = triangle(side);
        mesh.points.insert(mesh.points.end(), {{4, 0, 0}, {5, 0, 0}, {4, 1, 0}, {4, 1, 0}});
        // The last two have no area anyhow.
        mesh.triangles.insert(mesh.triangles.end(), {3, 4, 5, 0, 0, 1, 4, 5, 6});
        const Scene scene = build(mesh);
        EXPECT_EQ(scene.last_update().left_out.size(), count) << side;
        if (count > 0) {
            EXPECT_EQ(scene.last_update().left_out[0].too_small, count);
        }
    }
}

bool is_inside(const Scene& scene, Vec3 point, FillRule rule = FillRule::nonzero) {
    std::uint8_t inside = 0;
    scene.contains(std::span(&point, 1), std::span(&inside, 1), rule);
    return inside != 0;
}
int winding(const Scene& scene, Vec3 point) {
    std::int32_t winding = 0;
    scene.winding(std::span(&point, 1), std::span(&winding, 1));
    return winding;
}
float distance(const Scene& scene, Vec3 point) {
    float distance = 0;
    scene.signed_distance(std::span(&point, 1), std::span(&distance, 1));
    return distance;
}
ClosestPoint closest(const Scene& scene, Vec3 point) {
    ClosestPoint closest;
    scene.closest_points(std::span(&point, 1), std::span(&closest, 1));
    return closest;
}

TEST_P(Reports, Warp1836APointOutsideATetrahedronIsOutside) {
    const Scene scene = build(tetrahedron());
    std::vector<Vec3> points;
    for (int i = 0; i < 33 * 33 * 33; ++i) {
        const auto at = [](int k) { return static_cast<float>(k) / 8 - 2; };
        points.push_back({at(i % 33), at(i / 33 % 33), at(i / 33 / 33)});
    }
    std::vector<std::uint8_t> inside(points.size());
    scene.contains(points, inside);
    for (std::size_t i = 0; i < points.size(); ++i) {
        const Vec3 p = points[i];
        const bool expected = p.x >= 0 && p.y >= 0 && p.z >= 0 && p.x + p.y + p.z <= 1;
        ASSERT_EQ(inside[i] != 0, expected) << p.x << ' ' << p.y << ' ' << p.z;
    }
}

TEST_P(Reports, Parry76ADegenerateTriangleIsItsSegment) {
    UserMesh mesh;
    mesh.points = {{2.27699995f, -7.9000001f, 16.3180008f},
                   {-0.569999993f, -8.10000038f, 16.6070004f},
                   {-0.569999993f, -8.10000038f, 16.6070004f}};
    mesh.triangles = {0, 1, 2};
    const ClosestPoint found = closest(build(mesh), {1.10000002f, -7.9000001f, 16.5879993f});
    EXPECT_NEAR(found.distance, 0.171478327, 1e-6);
    EXPECT_NEAR(found.u + found.v, 0.4166943, 1e-6);
}

TEST_P(Reports, OfManyTrianglesThatAreEquallyFarTheLowestIsTheClosest) {
    // A vertex of each on a sphere, at whole coordinates; the others lie outside.
    constexpr int kRadius = 105;
    UserMesh mesh;
    for (int x = -kRadius; x <= kRadius; ++x) {
        for (int y = -kRadius; y <= kRadius; ++y) {
            for (int z = -kRadius; z <= kRadius; ++z) {
                if (x * x + y * y + z * z != kRadius * kRadius) continue;
                const Vec3 p = {static_cast<float>(x), static_cast<float>(y),
                                static_cast<float>(z)};
                const auto first = static_cast<std::uint32_t>(mesh.points.size());
                mesh.triangles.insert(mesh.triangles.end(), {first + 1, first + 2, first});
                mesh.points.insert(mesh.points.end(),
                                   {p, {2 * p.x, 2 * p.y, 2 * p.z}, {2 * p.x, 3 * p.y, 2 * p.z}});
            }
        }
    }
    ASSERT_GT(mesh.triangles.size(), std::size_t{3 * 128});
    // The same vertex twice, and one that is a little nearer.
    UserMesh nearer = mesh;
    nearer.points[3 * 100] = {-0x1.a3fffep+6f, 0, 0};
    UserMesh fan;
    fan.points = {{0, 0, 1}};
    for (int i = 0; i < 1000; ++i) {
        const auto angle = static_cast<float>(i);
        fan.points.push_back({std::cos(angle), std::sin(angle), 0});
        if (i > 0) {
            const auto at = static_cast<std::uint32_t>(i);
            fan.triangles.insert(fan.triangles.end(), {at, 0, at + 1});
        }
    }
    for (const auto& [asked, point, prim_id, far] : {std::tuple(&mesh, Vec3{0, 0, 0}, 0u, 105.0f),
                                                     {&nearer, {0, 0, 0}, 100u, 0x1.a3fffep+6f},
                                                     {&fan, {0, 0, 3}, 0u, 2.0f}}) {
        const ClosestPoint found = closest(build(*asked), point);
        EXPECT_EQ(found.prim_id, prim_id);
        EXPECT_EQ(found.distance, far);
        EXPECT_EQ(found.feature, morphray::Feature::vertex);
        EXPECT_NEAR(std::abs(distance(build(*asked), point)), far, 1e-4);
    }
}

TEST_P(Reports, Csxcad30AHalfLineThroughTheApexCountsOnce) {
    UserMesh mesh;
    const float half_root = static_cast<float>(std::sqrt(3.0) / 2);
    mesh.points = {{1, 0, -1}, {-0.5f, half_root, -1}, {-0.5f, -half_root, -1}, {0, 0, 1}};
    mesh.triangles = {0, 1, 2, 0, 3, 1, 0, 2, 3, 1, 3, 2};
    const Scene scene = build(mesh);
    EXPECT_EQ(winding(scene, {0, 0, 0}), -1);
    EXPECT_TRUE(is_inside(scene, {0, 0, 0}));
    EXPECT_TRUE(is_inside(scene, {0, 0, 0}, FillRule::odd));
    EXPECT_FALSE(is_inside(scene, {0, 0, 2}));
}

TEST_P(Reports, Fluidx3d59GridsOnTheFacesOfACubeAreExact) {
    const Scene scene = build(box({0, 0, 0}, {8, 8, 8}));
    std::vector<Vec3> centres;
    std::vector<Vec3> corners;
    for (int i = 0; i < 10 * 10 * 10; ++i) {
        const Vec3 p = {static_cast<float>(i % 10), static_cast<float>(i / 10 % 10),
                        static_cast<float>(i / 100)};
        corners.push_back({p.x - 0, p.y - 0, p.z - 0});
        centres.push_back({p.x - 0.5f, p.y - 0.5f, p.z - 0.5f});
    }
    const auto count = [&scene](const std::vector<Vec3>& points) {
        std::vector<std::uint8_t> inside(points.size());
        scene.contains(points, inside);
        return std::ranges::count(inside, 1);
    };
    EXPECT_EQ(count(centres), 512);
    EXPECT_EQ(count(corners), 729);
    std::vector<float> distances(corners.size());
    scene.signed_distance(corners, distances);
    EXPECT_EQ(std::ranges::count_if(distances, [](float d) { return d < 0; }), 343);
    EXPECT_EQ(std::ranges::count(distances, 0.0f), 386);
    // The points beside the face z = 8 by one ulp.
    EXPECT_TRUE(is_inside(scene, {4, 4, std::nextafter(8.0f, 0.0f)}));
    EXPECT_FALSE(is_inside(scene, {4, 4, std::nextafter(8.0f, 9.0f)}));
}

TEST_P(Reports, Inside3dMesh1ParityIsExactForTrianglesOfMixedDirections) {
    UserMesh mesh = box({0, 0, 0}, {1, 1, 1});
    for (std::size_t i = 0; i < mesh.triangles.size(); i += 6)
        std::swap(mesh.triangles[i + 1], mesh.triangles[i + 2]);
    const Scene scene = build(mesh);
    for (const float at : {0.25f, 0.5f, std::nextafter(1.0f, 0.0f)}) {
        EXPECT_TRUE(is_inside(scene, {at, at, at}, FillRule::odd)) << at;
        EXPECT_TRUE(is_inside(scene, {0.5f, at, 0.25f}, FillRule::odd)) << at;
    }
    EXPECT_FALSE(is_inside(scene, {0.5f, 0.5f, std::nextafter(1.0f, 2.0f)}, FillRule::odd));
    EXPECT_FALSE(is_inside(scene, {0.5f, 0.5f, -1}, FillRule::odd));
}

TEST_P(Reports, Dagmc986CoincidentCubesAreHitInTheOrderOfTheirNumbers) {
    const std::vector<UserMesh> cubes = {box({-10, -10, -10}, {10, 10, 10}),
                                         box({-10, -10, -10}, {10, 10, 10}),
                                         box({-57.5f, -57.5f, -57.5f}, {57.5f, 57.5f, 57.5f})};
    const Scene scene = build(cubes);
    const Ray across = ray({-20, 1, 2}, {1, 0, 0});
    std::vector<Hit> hits;
    for (Hit hit = scene.intersect(across); hit; hit = scene.intersect(across, hit))
        hits.push_back(hit);
    ASSERT_EQ(hits.size(), 5u);
    for (std::size_t i = 0; i < 4; ++i) {
        EXPECT_EQ(hits[i].geom_id, i % 2) << i;
        EXPECT_TRUE(is_within_an_ulp(hits[i].t, i < 2 ? 10 : 30)) << i;
    }
    EXPECT_EQ(hits[4].geom_id, 2u);
}

TEST_P(Reports, Drake21566OfEqualNeighboursTheLowestIsTheClosest) {
    UserMesh turned = tetrahedron();
    for (Vec3& p : turned.points) p = {-p.x, -p.y, -p.z};
    for (std::size_t i = 0; i < turned.triangles.size(); i += 3)
        std::swap(turned.triangles[i + 1], turned.triangles[i + 2]);
    const ClosestPoint found = closest(build(std::vector{tetrahedron(), turned}), {0, 0, 0});
    EXPECT_EQ(found.geom_id, 0u);
    EXPECT_EQ(found.prim_id, 0u);
    EXPECT_EQ(found.distance, 0);
    EXPECT_EQ(found.feature, morphray::Feature::vertex);
}

TEST_P(Reports, Pytorch3d1612TheDistanceIsThatOfThePointFound) {
    const UserMesh mesh = UserMesh(star(3, 4));
    const Scene scene = build(mesh);
    for (const Ray& from : world_rays(mesh, 300, 1612)) {
        const ClosestPoint found = closest(scene, from.org);
        const double dx = double{found.point.x} - from.org.x;
        const double dy = double{found.point.y} - from.org.y;
        const double dz = double{found.point.z} - from.org.z;
        EXPECT_NEAR(std::sqrt(dx * dx + dy * dy + dz * dz), found.distance,
                    1e-6 * (1 + found.distance));
    }
}

TEST_P(Reports, AClosestPointFromAnyDistanceIsThatOfTheSurface) {
    constexpr std::uint32_t kCells = 64;
    Shape plate = shapes::height_map(kCells, kCells, [](auto...) { return 0; });
    for (dvec3& p : plate.positions) p /= kCells;
    const Scene scene = build(UserMesh(TestScene(plate)));
    for (const float far : {1e-7f, 1e-4f, 0.02f, 0.2f, 0.5f, 1.0f, 1e3f, 1e7f, 1e10f}) {
        Random random(29);
        for (int i = 0; i < 50; ++i) {
            const Vec3 p{static_cast<float>(random.real(0, 1)),
                         static_cast<float>(random.real(0, 1)), far};
            const ClosestPoint found = closest(scene, p);
            EXPECT_EQ(found.point, (Vec3{p.x, p.y, 0})) << far;
            EXPECT_TRUE(is_within_an_ulp(found.distance, far));
            EXPECT_EQ(found.distance, std::abs(distance(scene, p)));
            const auto x = static_cast<std::uint32_t>(p.x * kCells);
            const auto y = static_cast<std::uint32_t>(p.y * kCells);
            const bool is_upper =
                p.y * kCells - static_cast<float>(y) > p.x * kCells - static_cast<float>(x);
            EXPECT_EQ(found.prim_id, 2 * (y * kCells + x) + is_upper) << far;
            EXPECT_EQ(found.feature, morphray::Feature::face);
        }
        // Beside the plate: an edge, a corner.
        EXPECT_EQ(closest(scene, {0.3f, -far, far}).point, (Vec3{0.3f, 0, 0}));
        EXPECT_EQ(closest(scene, {0.3f, -far, far}).feature, morphray::Feature::edge);
        EXPECT_EQ(closest(scene, {-far, -far, far}).point, (Vec3{0, 0, 0}));
        EXPECT_EQ(closest(scene, {-far, -far, far}).feature, morphray::Feature::vertex);
    }
}

TEST_P(Reports, ADistanceIsThatOfThePlaceHoweverNear) {
    for (const float size : {1e-30f, 1e-3f, 1.0f, 3e4f, 1e30f}) {
        UserMesh mesh = tetrahedron();
        for (Vec3& p : mesh.points) p = {p.x * size, p.y * size, p.z * size};
        const Scene scene = build(mesh);
        Random random(5);
        for (int i = 0; i < 2000; ++i) {
            // Beside the face x + y + z = size, over its inside.
            const auto part = [&] { return static_cast<float>(random.real(0.2, 0.35)) * size; };
            const auto beside = static_cast<float>(std::exp2(random.real(-30, -15)));
            Vec3 p{part(), part(), 0};
            p.z = size - p.x - p.y;
            p.z += (i % 2 == 0 ? beside : -beside) * size;
            // Exact: the floats are within a few powers of two.
            const double height = (double{p.x} + p.y + p.z - size) / std::sqrt(3.0);
            const ClosestPoint found = closest(scene, p);
            ASSERT_TRUE(is_within_an_ulp(found.distance, std::abs(height))) << size;
            ASSERT_EQ(found.distance == 0, height == 0);
            ASSERT_EQ(distance(scene, p), height < 0 ? -found.distance : found.distance);
            ASSERT_EQ(is_inside(scene, p), height <= 0);
        }
        EXPECT_FALSE(closest(scene, {NAN, 0, 0}));
        EXPECT_TRUE(std::isnan(distance(scene, {0, NAN, 0})));
        // Beside the face z = 0, much nearer than coordinates of that size are apart.
        for (const float beside : {1e-10f, 1e-20f, 1e-30f, 1e-43f, -1e-10f, -1e-43f}) {
            const Vec3 p{0.25f * size, 0.25f * size, beside};
            if (size < 1e-3f && std::abs(beside) > 1e-33f) continue;
            EXPECT_TRUE(is_within_an_ulp(closest(scene, p).distance, std::abs(beside))) << size;
            EXPECT_TRUE(is_within_an_ulp(distance(scene, p), -beside)) << size;
        }
    }
}

// Brute force, the best and no instruction set, Vulkan.
INSTANTIATE_TEST_SUITE_P(OnEachDevice, Reports, testing::Values("brute", "cpu", "off", "vulkan"),
                         [](const auto& each) { return std::string(each.param); });

}  // namespace
}  // namespace mray::test
