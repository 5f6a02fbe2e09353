// All hits, windings and closest points through the public interface.
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <limits>
#include <string>

#include "tests/library/answers.h"

namespace mray::test {
namespace {

using morphray::AllHits;
using morphray::ClosestPoint;
using morphray::Crossing;
using morphray::Device;
using morphray::ErrorCode;
using morphray::Feature;
using morphray::FillRule;
using morphray::Hit;
using morphray::Ray;
using morphray::Scene;
using morphray::Vec3;

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

/// A cube of side 2 around `centre`, counter-clockwise as seen from outside unless it is turned.
UserMesh cube(Vec3 centre = {}, bool is_turned = false, float half = 1) {
    UserMesh mesh;
    for (int i = 0; i < 8; ++i) {
        mesh.points.push_back({centre.x + ((i & 1) != 0 ? half : -half),
                               centre.y + ((i & 2) != 0 ? half : -half),
                               centre.z + ((i & 4) != 0 ? half : -half)});
    }
    const std::uint32_t quads[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                       {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    for (const auto& q : quads) {
        const std::uint32_t corners[6] = {q[0], q[1], q[2], q[0], q[2], q[3]};
        for (int i = 0; i < 6; ++i) {
            const int k = is_turned && i % 3 != 0 ? i / 3 * 3 + 3 - i % 3 : i;
            mesh.triangles.push_back(corners[k]);
        }
    }
    return mesh;
}

TEST(AllHits, AreInOrderAndThoseOfTheCursor) {
    const UserMesh mesh(star(3, 4));
    const Scene scene = Scene::build(mesh.view());
    const std::vector<Ray> rays = world_rays(mesh, 500, 6);
    for (const Crossing crossing : {Crossing::once, Crossing::each, Crossing::owner}) {
        const AllHits all = scene.intersect_all(rays, {.crossing = crossing});
        ASSERT_EQ(all.ray_count(), rays.size());
        std::vector<std::uint64_t> counts(rays.size());
        scene.count(rays, counts, crossing);
        for (std::size_t i = 0; i < rays.size(); ++i) {
            EXPECT_EQ(counts[i], all.of_ray(i).size());
            EXPECT_EQ(all.left_out[i], 0u);
            std::vector<Hit> stepped;
            // Before all hits: a cursor that is no hit.
            for (Hit hit =
                     scene.intersect(rays[i], Hit{.t = -1, .prim_id = 0, .geom_id = 0}, crossing);
                 hit; hit = scene.intersect(rays[i], hit, crossing))
                stepped.push_back(hit);
            EXPECT_TRUE(std::equal(stepped.begin(), stepped.end(), all.of_ray(i).begin(),
                                   all.of_ray(i).end()));
            if (crossing != Crossing::owner) {
                const Hit first = stepped.empty() ? Hit{} : stepped.front();
                EXPECT_EQ(first, scene.intersect(rays[i]));
            }
        }
    }
}

TEST(AllHits, AreSteppedThroughOnceEachWhereTIsRounded) {
    // In turn t is a denormal and too large for a float.
    for (const auto& [half, length] : {std::pair(1e-41f, 1.0f), {3e-39f, 2.0f}, {1e5f, 1e-36f}}) {
        UserMesh mesh;
        for (int i = 1; i <= 8; ++i) {
            const UserMesh one = cube({}, false, half * static_cast<float>(i) / 9);
            for (const std::uint32_t k : one.triangles)
                mesh.triangles.push_back(k + static_cast<std::uint32_t>(mesh.points.size()));
            mesh.points.insert(mesh.points.end(), one.points.begin(), one.points.end());
        }
        const Scene scene = Scene::build(mesh.view());
        const Ray ray = {{-2 * half, half / 64, half / 50}, 0, {length, length / 77, 0}};
        const AllHits all = scene.intersect_all({&ray, 1}, {.crossing = Crossing::each});
        EXPECT_EQ(all.hits.size(), 16u) << half;
        std::vector<Hit> stepped;
        for (Hit hit = scene.intersect(ray); hit && stepped.size() < 100;
             hit = scene.intersect(ray, hit))
            stepped.push_back(hit);
        EXPECT_TRUE(stepped == all.hits) << half;
    }
}

TEST(AllHits, ComeAfterACursorBeforeAllTriangles) {
    const UserMesh far = cube({8, 0, 0});
    const UserMesh near = cube();
    const std::vector<morphray::MeshView> meshes = {far.view(), near.view()};
    Scene scene = Scene::build(meshes);
    scene.detach(0);
    scene.update();
    const Ray ray = {{-2, 0.25f, 0.125f}, 0, {1, 0, 0}};
    const Hit first = scene.intersect(ray);
    EXPECT_EQ(first.geom_id, 1u);
    // The same t, with a triangle that is before all of the scene.
    EXPECT_EQ(scene.intersect(ray, Hit{.t = first.t, .prim_id = 5, .geom_id = 0}), first);
}

TEST(AllHits, SayHowManyAreLeftOut) {
    const UserMesh mesh(star(3, 4));
    const Scene scene = Scene::build(mesh.view());
    const std::vector<Ray> rays = world_rays(mesh, 500, 6);
    const AllHits all = scene.intersect_all(rays);
    for (const std::uint32_t most : {0u, 1u, 2u}) {
        const AllHits some = scene.intersect_all(rays, {.max_hits = most});
        for (std::size_t i = 0; i < rays.size(); ++i) {
            const auto hits = all.of_ray(i);
            const std::size_t listed = std::min<std::size_t>(most, hits.size());
            EXPECT_EQ(some.left_out[i], hits.size() - listed);
            EXPECT_TRUE(std::equal(hits.begin(), hits.begin() + static_cast<std::ptrdiff_t>(listed),
                                   some.of_ray(i).begin(), some.of_ray(i).end()));
        }
    }
}

TEST(AllHits, EnterAClosedMeshAsOftenAsTheyLeaveIt) {
    for (const char* const name : {"sphere", "cube"}) {
        const UserMesh mesh = name[0] == 's' ? UserMesh(icosphere(3)) : cube();
        const Scene scene = Scene::build(mesh.view());
        std::vector<Ray> from_inside;
        std::vector<Ray> from_outside;
        Random random(2);
        for (std::size_t i = 0; i < 6000; ++i) {  // At vertices, and at points of edges.
            const auto triangle =
                3 * random.below(static_cast<std::uint32_t>(mesh.triangles.size() / 3));
            const Vec3 a = mesh.points[mesh.triangles[triangle]];
            const Vec3 b = mesh.points[mesh.triangles[triangle + 1]];
            const float s = i % 2 == 0 ? 0 : static_cast<float>(random.real(0, 1));
            const Vec3 at = {a.x + s * (b.x - a.x), a.y + s * (b.y - a.y), a.z + s * (b.z - a.z)};
            from_inside.push_back({.org = {0, 0, 0}, .dir = at});
            from_outside.push_back(
                {.org = {8 * at.x, 8 * at.y, 8 * at.z}, .dir = {-at.x, -at.y, -at.z}});
        }
        std::vector<std::uint64_t> counts(from_inside.size());
        scene.count(from_inside, counts);
        for (const std::uint64_t count : counts) EXPECT_EQ(count, 1u) << name;
        scene.count(from_outside, counts);
        for (const std::uint64_t count : counts) EXPECT_TRUE(count == 0 || count == 2) << name;
    }
}

TEST(AllHits, HaveCoincidentTrianglesAllOfThem) {
    UserMesh mesh = cube();
    const std::vector<std::uint32_t> once = mesh.triangles;
    for (int i = 0; i < 40; ++i)
        mesh.triangles.insert(mesh.triangles.end(), once.begin(), once.end());
    const Scene scene = Scene::build(std::vector<morphray::MeshView>{mesh.view(), mesh.view()});
    const Ray ray = {.org = {0.25f, 0.5f, 5}, .dir = {0, 0, -1}};
    const AllHits all = scene.intersect_all({&ray, 1});
    ASSERT_EQ(all.hits.size(), 2u * 41 * 2);
    for (std::size_t i = 1; i < all.hits.size(); ++i) {
        const Hit& a = all.hits[i - 1];
        const Hit& b = all.hits[i];
        EXPECT_TRUE(std::tie(a.t, a.geom_id, a.prim_id) < std::tie(b.t, b.geom_id, b.prim_id));
    }
    const Vec3 inside = {0.1f, 0.2f, 0.3f};
    std::int32_t winding = 0;
    scene.winding({&inside, 1}, {&winding, 1});
    EXPECT_EQ(winding, 82);
}

TEST(VisibleHits, AreTheFirstOfAllHitsThatAreVisible) {
    for (const std::string& simd : morphray::simd_targets())
        expect_visible_hits_on(Device::cpu({.simd = simd}), 300);
    expect_visible_hits_on(Device::brute_force(), 60);
}

TEST(VisibleHits, TakeAFlagForEachGeomId) {
    const UserMesh mesh(star(3, 4));
    Scene scene = Scene::build(std::vector(4, mesh.view()));
    const Ray ray{.org = {0.1f, 0.2f, 9}, .dir = {0, 0, -1}};
    const auto answer_to = [&](std::size_t flags) -> std::string {
        const std::vector<std::uint8_t> visible(flags, 1);
        return error_of([&] { scene.intersect(ray, {.visible = visible}); });
    };
    for (const std::size_t flags : {0, 1, 3, 5}) EXPECT_EQ(answer_to(flags), "bad_argument");
    EXPECT_EQ(answer_to(4), "none");
    // Flags for geom_ids that were used are as good.
    scene.detach(3);
    scene.detach(1);
    scene.update();
    EXPECT_EQ(answer_to(2), "bad_argument");
    EXPECT_EQ(answer_to(3), "none");
    EXPECT_EQ(answer_to(4), "none");
    EXPECT_EQ(error_of([&] {
                  scene.intersect(ray, {.excluded = std::span<const morphray::Primitive>()});
              }),
              "bad_argument");
}

TEST(VisibleHits, LeaveOutTheTriangleThatARayNames) {
    expect_excluded_on(Device::cpu(), 200);
    expect_excluded_on(Device::brute_force(), 40);
    const UserMesh mesh(star(3, 4));
    const Scene scene = Scene::build(mesh.view());
    const std::vector<Ray> rays(3);
    const std::vector<morphray::Primitive> two(2);
    std::vector<morphray::Hit> hits(rays.size());
    EXPECT_EQ(error_of([&] { scene.intersect(rays, hits, {.excluded = two}); }), "bad_argument");
    const std::vector<morphray::Vec3> points(2);
    std::vector<std::int32_t> windings(points.size());
    EXPECT_EQ(error_of([&] { scene.winding(points, windings, {.excluded = two}); }),
              "bad_argument");
}

TEST(Windings, AddUpWhereMeshesAreNestedOrOverlap) {
    const UserMesh outer = cube({}, false, 4);
    const UserMesh inner = cube();
    const UserMesh hole = cube({}, true);
    const UserMesh beside = cube({1, 0, 0});
    const std::vector<Vec3> points = {
        {-0.5f, 0, 0}, {3, 3, 3}, {5, 0, 0}, {0.5f, 0, 0}, {1.5f, 0, 0}};
    const auto windings = [&](std::initializer_list<const UserMesh*> meshes) {
        std::vector<morphray::MeshView> views;
        for (const UserMesh* const mesh : meshes) views.push_back(mesh->view());
        std::vector<std::int32_t> result(points.size());
        Scene::build(views).winding(points, result);
        return result;
    };
    EXPECT_EQ(windings({&inner}), (std::vector{1, 0, 0, 1, 0}));
    EXPECT_EQ(windings({&hole}), (std::vector{-1, 0, 0, -1, 0}));
    EXPECT_EQ(windings({&outer, &inner}), (std::vector{2, 1, 0, 2, 1}));
    EXPECT_EQ(windings({&outer, &hole}), (std::vector{0, 1, 0, 0, 1}));
    EXPECT_EQ(windings({&inner, &beside}), (std::vector{1, 0, 0, 2, 1}));
    const Scene overlap =
        Scene::build(std::vector<morphray::MeshView>{inner.view(), beside.view()});
    std::vector<std::uint8_t> inside(points.size());
    overlap.contains(points, inside);
    EXPECT_EQ(inside, (std::vector<std::uint8_t>{1, 0, 0, 1, 1}));
    overlap.contains(points, inside, FillRule::odd);
    EXPECT_EQ(inside, (std::vector<std::uint8_t>{1, 0, 0, 0, 1}));
}

TEST(Windings, ContainTheSurfaceExactly) {
    const UserMesh mesh = cube();
    const Scene scene = Scene::build(mesh.view());
    const float above = std::nextafter(1.0f, 2.0f);
    const float below = std::nextafter(1.0f, 0.0f);
    // On faces, edges and vertices, a float farther, a float nearer.
    for (const Vec3 p : {Vec3{1, 0.3f, 0.1f}, Vec3{0.3f, -0.3f, 1}, Vec3{1, 1, 0.2f},
                         Vec3{1, 0.1f, 1}, Vec3{1, 1, 1}, Vec3{-1, 1, 1}, Vec3{0, 0, -1}}) {
        const auto moved = [&](float size) {
            const auto along = [&](float x) { return std::abs(x) == 1 ? x * size : x; };
            return Vec3{along(p.x), along(p.y), along(p.z)};
        };
        const Vec3 points[3] = {p, moved(above), moved(below)};
        std::uint8_t inside[3];
        float distances[3];
        scene.contains(points, inside);
        scene.signed_distance(points, distances);
        EXPECT_EQ(inside[0], 1);
        EXPECT_EQ(inside[1], 0);
        EXPECT_EQ(inside[2], 1);
        EXPECT_EQ(distances[0], 0);
        EXPECT_GT(distances[1], 0);
        EXPECT_LT(distances[2], 0);
    }
}

TEST(Windings, AreExactForCoordinatesThatSceneSpaceRounds) {
    UserMesh mesh = cube();
    for (Vec3& p : mesh.points)
        if (p.y < 0) p.y = 3e-17f;
    const Scene scene = Scene::build(mesh.view());
    const Vec3 points[4] = {
        {0.3f, 2e-17f, 0.1f}, {0.3f, 4e-17f, 0.1f}, {0.3f, 3e-17f, 0.1f}, {0.3f, 0, 0.1f}};
    std::uint8_t inside[4];
    scene.contains(points, inside);
    EXPECT_EQ(inside[0], 0);
    EXPECT_EQ(inside[1], 1);
    EXPECT_EQ(inside[2], 1);
    EXPECT_EQ(inside[3], 0);
}

TEST(ClosestPoints, TellPlaceFeatureAndTriangle) {
    const UserMesh mesh = cube();
    const Scene scene = Scene::build(mesh.view());
    const std::vector<Vec3> points = {{0.5f, 0.25f, 3}, {2, 2, 0.5f}, {4, 5, 1}, {0, 0, 0.5f}};
    std::vector<ClosestPoint> closest(points.size());
    scene.closest_points(points, closest);
    EXPECT_EQ(closest[0].point, (Vec3{0.5f, 0.25f, 1}));
    EXPECT_EQ(closest[0].distance, 2);
    EXPECT_EQ(closest[0].feature, Feature::face);
    EXPECT_EQ(closest[1].point, (Vec3{1, 1, 0.5f}));
    EXPECT_EQ(closest[1].distance, std::sqrt(2.0f));
    EXPECT_EQ(closest[1].feature, Feature::edge);
    EXPECT_EQ(closest[2].point, (Vec3{1, 1, 1}));
    EXPECT_EQ(closest[2].distance, 5);
    EXPECT_EQ(closest[2].feature, Feature::vertex);
    EXPECT_EQ(closest[3].distance, 0.5f);
    // The first of the triangles around the edge and the vertex.
    EXPECT_EQ(closest[1].prim_id, 7u);
    EXPECT_EQ(closest[2].prim_id, 2u);
    scene.closest_points(points, closest, 1);
    EXPECT_FALSE(closest[0]);
    EXPECT_EQ(closest[0].distance, kInfinity);
    EXPECT_FALSE(closest[1]);
    EXPECT_TRUE(closest[3]);
    scene.closest_points(points, closest, 2);
    EXPECT_TRUE(closest[0]);
}

TEST(ClosestPoints, AreFoundWithinExactlyTheirDistance) {
    // Distances of the last ones are denormals, which rounding changes by a larger part.
    for (const float half : {1.0f, 1e-3f, 1e-37f, 3e-38f, 1e-40f, 1e-42f}) {
        const UserMesh mesh = cube({}, false, half);
        const Scene scene = Scene::build(mesh.view());
        std::vector<Vec3> points;
        for (int i = 0; i < 100; ++i) {
            const auto part = [&](int by) { return half * static_cast<float>(i * by % 41) / 10; };
            points.push_back({part(7), part(11), part(17)});
        }
        std::vector<ClosestPoint> closest(points.size());
        scene.closest_points(points, closest);
        for (std::size_t i = 0; i < points.size(); ++i) {
            ClosestPoint again;
            scene.closest_points({&points[i], 1}, {&again, 1}, closest[i].distance);
            EXPECT_EQ(again, closest[i]) << half << ", point " << i;
            float all = 0;
            float distance = 0;
            scene.signed_distance({&points[i], 1}, {&all, 1});
            scene.signed_distance({&points[i], 1}, {&distance, 1}, FillRule::nonzero,
                                  std::abs(all));
            EXPECT_EQ(distance, all) << half << ", point " << i;
            const float less = std::nextafter(closest[i].distance, -1.0f);
            if (less < 0) continue;
            scene.closest_points({&points[i], 1}, {&again, 1}, less);
            EXPECT_FALSE(again) << half << ", point " << i;
            scene.signed_distance({&points[i], 1}, {&distance, 1}, FillRule::nonzero,
                                  std::nextafter(std::abs(all), -1.0f));
            EXPECT_EQ(distance, all == 0 ? 0 : std::copysign(kInfinity, all));
        }
    }
}

TEST(ClosestPoints, HaveDefinedAnswersForBadPointsAndEmptyScenes) {
    const std::vector<Vec3> points = {{kNan, 0, 0}, {kInfinity, 0, 0}, {1e30f, 0, 0}, {0, 0, 0}};
    const UserMesh mesh = cube();
    const UserMesh none;
    for (const UserMesh* const one : {&mesh, &none}) {
        const Scene scene = Scene::build(one->view());
        const PointAnswers answers(scene, points);
        for (std::size_t i = 0; i < 3; ++i) {
            EXPECT_EQ(bool{answers.closest[i]}, i == 2 && one == &mesh);
            EXPECT_EQ(answers.inside[i], 0);
            EXPECT_EQ(answers.windings[i], 0);
        }
        EXPECT_TRUE(std::isnan(answers.distances[0]));
        EXPECT_TRUE(std::isnan(answers.distances[1]));
        EXPECT_EQ(answers.distances[2], one == &none ? kInfinity : 1e30f);
        EXPECT_EQ(answers.distances[3], one == &none ? kInfinity : -1.0f);
        EXPECT_EQ(answers.inside[3], one == &none ? 0 : 1);
        EXPECT_EQ(scene.intersect_all({}).ray_count(), 0u);
    }
}

TEST(Questions, AreCancelledByAFlagThatIsTrueBefore) {
    expect_all_are_cancelled_on(Device::cpu());
    expect_all_are_cancelled_on(Device::brute_force());
}

TEST(Questions, AreTheSameOnEachCpuDeviceAndAfterEachUpdate) {
    expect_same_answers_on({Device::cpu({.threads = 1, .simd = "scalar"}),
                            Device::cpu({.threads = 3, .simd = "off"})});
}

}  // namespace
}  // namespace mray::test
