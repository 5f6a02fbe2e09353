// Points of reports by users of other tools: inside, winding, distance and the closest triangle.
#include <algorithm>
#include <limits>

#include "tests/reports/devices.h"

namespace mray::test {
namespace {

using morphray::ClosestPoint;
using morphray::FillRule;
using morphray::Hit;
using morphray::Scene;
using morphray::Vec3;

class PointReports : public Reports {
protected:
    static bool is_inside(const Scene& scene, Vec3 point, FillRule rule = FillRule::nonzero) {
        std::uint8_t inside = 0;
        scene.contains(std::span(&point, 1), std::span(&inside, 1), rule);
        return inside != 0;
    }
    static int winding(const Scene& scene, Vec3 point) {
        std::int32_t winding = 0;
        scene.winding(std::span(&point, 1), std::span(&winding, 1));
        return winding;
    }
    static float distance(const Scene& scene, Vec3 point) {
        float distance = 0;
        scene.signed_distance(std::span(&point, 1), std::span(&distance, 1));
        return distance;
    }
    static ClosestPoint closest(const Scene& scene, Vec3 point) {
        ClosestPoint closest;
        scene.closest_points(std::span(&point, 1), std::span(&closest, 1));
        return closest;
    }
};

TEST_P(PointReports, Warp1836APointOutsideATetrahedronIsOutside) {
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

TEST_P(PointReports, OpenBoxIsNotClosed) {
    UserMesh mesh = box({0, 0, 0}, {1, 1, 1});
    EXPECT_EQ(build(mesh).edge_counts(), morphray::EdgeCounts{});
    // Without its top.
    mesh.triangles.erase(mesh.triangles.begin() + 6, mesh.triangles.begin() + 12);
    const Scene scene = build(mesh);
    EXPECT_EQ(scene.edge_counts(), (morphray::EdgeCounts{.open = 4, .uneven = 4}));
    EXPECT_FALSE(scene.edge_counts().is_closed());
}

TEST_P(PointReports, Trimesh73DistancesToEdgesAndCornersHaveTheRightSign) {
    const Scene scene = build(box({0, 0, 0}, {2, 2, 2}));
    EXPECT_TRUE(is_within_an_ulp(distance(scene, {3, 2, 2}), 1));
    EXPECT_TRUE(is_within_an_ulp(distance(scene, {3, 3, 3}), std::sqrt(3.0)));
    EXPECT_TRUE(is_within_an_ulp(distance(scene, {3, 2, 1}), 1));
    EXPECT_TRUE(is_within_an_ulp(distance(scene, {1.5f, 1, 1}), -0.5));
}

TEST_P(PointReports, Parry76ADegenerateTriangleIsItsSegment) {
    UserMesh mesh;
    mesh.points = {{2.27699995f, -7.9000001f, 16.3180008f},
                   {-0.569999993f, -8.10000038f, 16.6070004f},
                   {-0.569999993f, -8.10000038f, 16.6070004f}};
    mesh.triangles = {0, 1, 2};
    const ClosestPoint found = closest(build(mesh), {1.10000002f, -7.9000001f, 16.5879993f});
    EXPECT_NEAR(found.distance, 0.171478327, 1e-6);
    EXPECT_NEAR(found.u + found.v, 0.4166943, 1e-6);
}

TEST_P(PointReports, Csxcad30AHalfLineThroughTheApexCountsOnce) {
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

TEST_P(PointReports, Fluidx3d59GridsOnTheFacesOfACubeAreExact) {
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

TEST_P(PointReports, Inside3dMesh1ParityIsExactForTrianglesOfMixedDirections) {
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

TEST_P(PointReports, Dagmc986CoincidentCubesAreHitInTheOrderOfTheirNumbers) {
    const std::vector<UserMesh> cubes = {box({-10, -10, -10}, {10, 10, 10}),
                                         box({-10, -10, -10}, {10, 10, 10}),
                                         box({-57.5f, -57.5f, -57.5f}, {57.5f, 57.5f, 57.5f})};
    const Scene scene = build(cubes);
    const morphray::Ray across = ray({-20, 1, 2}, {1, 0, 0});
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

TEST_P(PointReports, Drake21566OfEqualNeighboursTheLowestIsTheClosest) {
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

TEST_P(PointReports, Pytorch3d1612TheDistanceIsThatOfThePointFound) {
    const UserMesh mesh = UserMesh(star(3, 4));
    const Scene scene = build(mesh);
    for (const morphray::Ray& from : world_rays(mesh, 300, 1612)) {
        const ClosestPoint found = closest(scene, from.org);
        const double dx = double{found.point.x} - from.org.x;
        const double dy = double{found.point.y} - from.org.y;
        const double dz = double{found.point.z} - from.org.z;
        EXPECT_NEAR(std::sqrt(dx * dx + dy * dy + dz * dz), found.distance,
                    1e-6 * (1 + found.distance));
    }
}

TEST_P(PointReports, AClosestPointFromAnyDistanceIsThatOfTheSurface) {
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

TEST_P(PointReports, ADistanceIsThatOfThePlaceHoweverNear) {
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

INSTANTIATE_TEST_SUITE_P(OnEachDevice, PointReports, report_devices(),
                         [](const auto& each) { return std::string(each.param); });

}  // namespace
}  // namespace mray::test
