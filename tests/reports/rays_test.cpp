// Rays of reports by users of other tools. Expected values come from rational arithmetic on the
// floats given.
#include <algorithm>
#include <limits>
#include <numbers>

#include "tests/reports/devices.h"

namespace mray::test {
namespace {

using morphray::Crossing;
using morphray::Hit;
using morphray::Ray;
using morphray::Scene;
using morphray::Vec3;

class RayReports : public Reports {};

TEST_P(RayReports, Oblikovati2146AQuadIsHitOnItsDiagonal) {
    const Scene scene = build(square(-5, 5));
    const Ray diagonal = ray({0, 0, 10}, {0.30458447f, 0.30458447f, -0.9024725f});
    const Hit hit = scene.intersect(diagonal);
    EXPECT_EQ(hit.prim_id, 0u);
    EXPECT_TRUE(is_within_an_ulp(hit.t, 11.080670096828632));
    EXPECT_EQ(all_hits(scene, diagonal, Crossing::each).size(), 2u);
    EXPECT_EQ(all_hits(scene, diagonal, Crossing::owner).size(), 1u);
}

TEST_P(RayReports, Tinybvh283SmallTrianglesAreHit) {
    for (const auto& [size, distance] :
         {std::pair(2e-4f, 1.0f), {1e-6f, 1e-3f}, {1e-12f, 1e-9f}, {1e-20f, 1e-17f}}) {
        const Hit hit =
            build(triangle(size)).intersect(ray({size / 3, size / 3, -distance}, {0, 0, 1}));
        EXPECT_EQ(hit.prim_id, 0u) << size;
        EXPECT_TRUE(is_within_an_ulp(hit.t, distance)) << size;
    }
}

TEST_P(RayReports, Libigl2408ScaledMeshesKeepTheirHits) {
    const UserMesh mesh = UserMesh(star(3, 4));
    const std::vector<Ray> rays = world_rays(mesh, 200, 2408);
    const std::vector<Hit> expected = hits_of(build(mesh), rays);
    for (const int power : {-10, -33}) {
        const auto scaled = [power](Vec3 p) {
            return Vec3{std::ldexp(p.x, power), std::ldexp(p.y, power), std::ldexp(p.z, power)};
        };
        UserMesh small = mesh;
        for (Vec3& p : small.points) p = scaled(p);
        std::vector<Ray> near = rays;
        for (Ray& r : near) {
            r.org = scaled(r.org);
            r.dir = scaled(r.dir);
        }
        EXPECT_EQ(hits_of(build(small), near), expected) << power;
    }
}

TEST_P(RayReports, Amrex5789ALongSegmentBesideATriangleMisses) {
    const Scene scene = build(triangle(1));
    for (const float far : {1e9f, 1e5f})
        EXPECT_FALSE(scene.intersect(ray({0.75f, 0.75f, -far}, {0, 0, 2 * far}))) << far;
}

TEST_P(RayReports, ThreeMeshBvh684ARayThroughAnEdgeHitsIt) {
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

TEST_P(RayReports, ThreeMeshBvh169AndRapier165VerticesAndEdgesOfHeightMapsAreHit) {
    constexpr std::uint32_t kSide = 8;
    Random random(169);
    const UserMesh map(TestScene(
        shapes::height_map(kSide - 1, kSide - 1, [&](auto...) { return random.below(2); })));
    const Scene scene = build(map);
    for (const Vec3& p : map.points)
        EXPECT_TRUE(is_within_an_ulp(scene.intersect(ray({p.x, p.y, 10}, {0, 0, -1})).t, 10 - p.z));
    // Along the cells' edges of constant x.
    for (std::size_t i = 0; i + kSide < map.points.size(); ++i) {
        const Vec3 a = map.points[i];
        const Vec3 b = map.points[i + kSide];
        const Hit hit = scene.intersect(ray({a.x, a.y + 0.25f, 10}, {0, 0, -1}));
        EXPECT_TRUE(is_within_an_ulp(hit.t, 10 - (0.75 * a.z + 0.25 * b.z)));
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

TEST_P(RayReports, AllHitsOfAHeightMapHaveEachCrossingOnce) {
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
        EXPECT_FALSE(scene.intersect(rays[i], hits[0], Crossing::once));
        EXPECT_EQ(all_hits(scene, rays[i], Crossing::each).size(),
                  triangles_at(map, rays[i].org.x, rays[i].org.y));
    }
}

TEST_P(RayReports, Pyvista8698ThePoleOfASphereIsCrossedWhateverTheEnd) {
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

TEST_P(RayReports, Pyvista4842And5372AndLibigl2026FacesAreCrossedOnceOnTheirDiagonals) {
    const Scene high = build(box({0, 0, 0}, {10, 10, 6}));
    const std::vector<Hit> through = all_hits(high, ray({5, 2, -10}, {0, 0, 1}), Crossing::owner);
    ASSERT_EQ(through.size(), 2u);
    EXPECT_TRUE(is_within_an_ulp(through[0].t, 10));
    EXPECT_TRUE(is_within_an_ulp(through[1].t, 16));

    const Scene flat = build(square(-1, 1));
    const Ray down = ray({0, 0, 1}, {0, 0, -1});
    for (const Hit& hit : all_hits(flat, down, Crossing::each))
        EXPECT_TRUE(is_within_an_ulp(hit.t, 1));
    EXPECT_EQ(all_hits(flat, down, Crossing::each).size(), 2u);
    EXPECT_EQ(all_hits(flat, down, Crossing::owner).size(), 1u);

    const Scene unit = build(box({-0.5f, -0.5f, -0.5f}, {0.5f, 0.5f, 0.5f}));
    const std::vector<Hit> diagonal =
        all_hits(unit, ray({1, 0.1f, 0.1f}, {-1, 0, 0}), Crossing::owner);
    ASSERT_EQ(diagonal.size(), 2u);
    EXPECT_TRUE(is_within_an_ulp(diagonal[0].t, 0.5));
    EXPECT_TRUE(is_within_an_ulp(diagonal[1].t, 1.5));
}

TEST_P(RayReports, Fcpw14ACubeIsEnteredAndLeft) {
    UserMesh cube = box({1.6f, 1.6f, 1.6f}, {14.4f, 14.4f, 14.4f});
    cube.triangles = {2, 1, 0, 1, 2, 3, 4, 2, 0, 2, 4, 6, 1, 4, 0, 4, 1, 5,
                      6, 5, 7, 5, 6, 4, 3, 6, 7, 6, 3, 2, 5, 3, 7, 3, 5, 1};
    const std::vector<Hit> hits =
        all_hits(build(cube), ray({1, 8, 11.5f}, {1, 0, 0}), Crossing::owner);
    ASSERT_EQ(hits.size(), 2u);
    EXPECT_EQ(hits[0].prim_id, 3u);
    EXPECT_EQ(hits[1].prim_id, 10u);
    EXPECT_NEAR(hits[0].t, 0.6000000238418579, 1e-6);
    EXPECT_TRUE(is_within_an_ulp(hits[1].t, 13.399999618530273));
}

TEST_P(RayReports, Pymskt42ThinWallsHaveTwoSides) {
    const Scene scene = build(box({0, 0, 0}, {0.03f, 0.03f, 0.002f}));
    const std::vector<Hit> hits =
        all_hits(scene, ray({0.01f, 0.02f, 1}, {0, 0, -1}), Crossing::each);
    ASSERT_EQ(hits.size(), 2u);
    EXPECT_GT(hits[1].t, hits[0].t);
}

TEST_P(RayReports, Physx349AndLibigl2536RangesEndWhereTheySay) {
    const Scene scene = build(tetrahedron());
    Ray down = ray({0.25f, 0.25f, 2}, {0, 0, -1});
    down.tfar = 1.25f;
    EXPECT_FALSE(scene.intersect(down));
    down.tfar = 2;
    EXPECT_TRUE(is_within_an_ulp(scene.intersect(down).t, 1.5));
    down.tnear = 1.75f;
    EXPECT_TRUE(is_within_an_ulp(scene.intersect(down).t, 2));
    const std::vector<Hit> hits = all_hits(scene, down, Crossing::each);
    ASSERT_EQ(hits.size(), 1u);
    EXPECT_EQ(hits[0].prim_id, 0u);
}

TEST_P(RayReports, Trimesh2245OccludedIsWhereThereIsAHit) {
    const UserMesh mesh = UserMesh(star(3, 4));
    const Scene scene = build(mesh);
    const std::vector<Ray> rays = world_rays(mesh, 2000, 2245);
    const std::vector<Hit> hits = hits_of(scene, rays);
    std::vector<std::uint8_t> occluded(rays.size());
    scene.occluded(rays, occluded);
    for (std::size_t i = 0; i < rays.size(); ++i) EXPECT_EQ(occluded[i] != 0, bool(hits[i])) << i;
}

TEST_P(RayReports, ThreeMeshBvh112AMoveThatIsExactKeepsHits) {
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

TEST_P(RayReports, PythonEmbree20ThePlaneBelowIsExactlyAsFarAsTheOriginIsHigh) {
    const Scene scene = build(square(0, 1));
    Random random(20);
    std::vector<Ray> rays(500);
    std::vector<Ray> up_to(rays.size());
    std::vector<Ray> from(rays.size());
    for (std::size_t i = 0; i < rays.size(); ++i) {
        rays[i] = ray(
            {static_cast<float>(random.real(0, 1)), static_cast<float>(random.real(0, 1)), 1000.1f},
            {0, 0, -1});
        up_to[i] = from[i] = rays[i];
        up_to[i].tfar = from[i].tnear = 1000.1f;
    }
    for (const std::vector<Ray>& each : {rays, up_to, from})
        for (const Hit& hit : hits_of(scene, each)) EXPECT_EQ(hit.t, 1000.1f);
}

TEST_P(RayReports, ARayFromAnywhereFindsWhatItHits) {
    UserMesh below = triangle(1);
    for (Vec3& p : below.points) p.z = -1;
    const Scene scene = build(std::vector{triangle(1), below});
    for (const float far : {1e3f, 2e3f, 1e6f, 1e9f, 1e20f, 3e38f}) {
        const std::vector<Ray> rays = {
            ray({0.25f, 0.25f, far}, {0, 0, -1}), ray({0.25f, 0.25f, far}, {0, 0, -2 * far}),
            ray({0.25f, 0.25f, far}, {0, 0, 1}), ray({0.75f, 0.75f, far}, {0, 0, -1}),
            ray({-far, 0.25f, 0.5f}, {1, 0, 0})};
        const std::vector<Hit> hits = hits_of(scene, rays);
        EXPECT_EQ(hits[0].t, far);
        EXPECT_EQ(hits[0].geom_id, 0u);
        EXPECT_EQ(bool{hits[1]}, 2 * far < INFINITY);
        if (hits[1]) {
            EXPECT_EQ(hits[1].t, 0.5f);
        }
        for (std::size_t i : {2, 3, 4}) EXPECT_FALSE(hits[i]) << far << ' ' << i;
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

TEST_P(RayReports, DevilRay62AndOpensimCreator976AnExplodedVertexHidesNothingElse) {
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
    expect_same_hits(hits_with_vertex_at(scene, mesh, rest, rays), sound, "back");
    EXPECT_TRUE(scene.last_update().left_out.empty());
    // A body may leave the scene for good, as long as floats have room for both.
    hits_with_vertex_at(scene, mesh, {0, 1e8f, 0}, rays);
    EXPECT_TRUE(scene.last_update().left_out.empty());
    EXPECT_GT(scene.bounds().upper[1], 9e7);
}

TEST_P(RayReports, AFarVertexThatNoTriangleUsesOrThatIsOfAnotherMeshChangesNoBit) {
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
    UserMesh far = tetrahedron();
    for (Vec3& p : far.points) p = {p.x + 1e20f, p.y, p.z};
    const Scene both = build({mesh, far});
    expect_same_hits(hits_of(both, rays), expected, "another mesh");
    ASSERT_EQ(both.last_update().left_out.size(), 1u);
    EXPECT_EQ(both.last_update().left_out[0].geom_id, 1u);
    EXPECT_EQ(both.last_update().left_out[0].too_far, 4u);
}

INSTANTIATE_TEST_SUITE_P(OnEachDevice, RayReports, report_devices(),
                         [](const auto& each) { return std::string(each.param); });

}  // namespace
}  // namespace mray::test
