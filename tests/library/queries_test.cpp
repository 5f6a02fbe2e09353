// Closest and any hits, all hits, windings and closest points through the public interface, of rays
// in any order.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <limits>
#include <string>
#include <thread>
#include <vector>

#include "common/watched_runs.h"
#include "library/src/ray_order.h"
#include "tests/library/answers.h"
#include "tests/library/scenes.h"

namespace mray::test {
namespace {

using morphray::AllHits;
using morphray::ClosestPoint;
using morphray::Coherence;
using morphray::Crossing;
using morphray::Device;
using morphray::FillRule;
using morphray::Hit;
using morphray::Ray;
using morphray::Scene;
using morphray::Vec3;

constexpr std::size_t kRays = 2000;
constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

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

constexpr std::size_t kMany = 20000;

/// Rays of an image and a few more, which are traced in packets where they can. In bands of its
/// rows their lengths differ, and some are no rays of the image.
std::vector<Ray> camera_rays(int width, int height) {
    Random random(21);
    std::vector<Ray> rays;
    for (int i = 0; i < width * height + 5; ++i) {
        const float x = 2 * static_cast<float>(i % width) / static_cast<float>(width) - 1;
        const float y = static_cast<float>(i / width) / static_cast<float>(height) - 0.5f;
        const int band = i / width * 8 / height % 4;
        const float length = band == 1 ? static_cast<float>(random.real(0.2, 7)) : 1.0f;
        rays.push_back({.org = {0.3f, 0.2f, 3},
                        .dir = {length * (x + 0.2f * y), length * (y - 0.2f * x), -length}});
        if (band == 2 && random.below(500) == 0) rays.back().tfar = 2.5f;
        if (band == 3 && random.below(500) == 0) rays.back().dir = {1, 0, 0};
    }
    return rays;
}

/// Replaces every 97th ray by one of those that make no sense.
void make_hostile(std::vector<Ray>& rays) {
    constexpr float kMost = std::numeric_limits<float>::max();
    const Ray hostile[] = {{.org = {kNan, 0, 0}, .dir = {0, 0, 1}},
                           {.org = {0, 0, 0}, .dir = {0, 0, 0}},
                           {.org = {kMost, -kMost, kMost}, .dir = {kMost, kMost, kMost}},
                           {.org = {0, 0, 0}, .dir = {kInfinity, -kInfinity, 0}},
                           {.org = {0, kInfinity, 0}, .dir = {1e-40f, 0, 0}},
                           {.org = {0, 0, 0}, .dir = {kNan, 1, 1}}};
    for (std::size_t i = 0; i < rays.size(); i += 97) rays[i] = hostile[i % std::size(hostile)];
}

TEST(Queries, OfManyRaysAreThoseOfOneRayWhateverTheCallerSaysOfThem) {
    const UserMesh mesh(torus(60, 40));
    std::vector<Ray> any_rays = world_rays(mesh, kMany, 7);
    make_hostile(any_rays);
    const Scene reference = Scene::build(mesh.view());
    constexpr std::size_t kHuge = std::numeric_limits<std::size_t>::max();
    for (const auto& [rays, width] : {std::pair(any_rays, std::size_t{200}),
                                      {camera_rays(203, 101), 203},
                                      {camera_rays(3, 2400), 3}}) {
        std::vector<morphray::Hit> expected;
        std::vector<std::uint64_t> expected_counts(rays.size());
        for (std::size_t i = 0; i < rays.size(); ++i) {
            expected.push_back(reference.intersect(rays[i]));
            reference.count(std::span(rays).subspan(i, 1),
                            std::span(expected_counts).subspan(i, 1));
        }
        EXPECT_GT(count_hits(expected), kMany / 50) << width;
        for (const std::string& simd : all_simd()) {
            const Scene scene =
                Scene::build(mesh.view(), Device::cpu({.threads = 3, .simd = simd}));
            // Few rays are traced one by one, more of them in streams.
            const morphray::Hit untouched{-1, -2, -3, 77, 88};
            for (std::size_t size = 0; size <= 70; ++size) {
                const auto some = std::span(rays).subspan(97 * size, size);
                std::vector<morphray::Hit> hits(size + 1, untouched);
                std::vector<std::uint8_t> occluded(size + 1, 7);
                scene.intersect(some, std::span(hits).first(size));
                scene.occluded(some, std::span(occluded).first(size));
                for (std::size_t i = 0; i < size; ++i) {
                    ASSERT_EQ(hits[i], expected[97 * size + i]) << simd << ", " << size;
                    ASSERT_EQ(occluded[i], hits[i] ? 1 : 0) << simd << ", " << size;
                }
                EXPECT_EQ(hits[size], untouched);
                EXPECT_EQ(occluded[size], 7);
            }
            for (const Coherence coherence :
                 {Coherence::none(), Coherence::sort(), Coherence::image(0), Coherence::image(9),
                  Coherence::image(width), Coherence::image(kHuge)}) {
                expect_same_hits(hits_of(scene, rays, coherence), expected, simd);
                std::vector<morphray::Hit> hits(rays.size());
                scene.intersect(rays, hits, {coherence, morphray::Threads::calling});
                expect_same_hits(hits, expected, simd);
                std::vector<std::uint8_t> occluded(rays.size(), 2);
                scene.occluded(rays, occluded, {coherence});
                for (std::size_t i = 0; i < rays.size(); ++i)
                    ASSERT_EQ(occluded[i], expected[i] ? 1 : 0) << simd << ", ray " << i;
                std::vector<std::uint64_t> counts(rays.size(), 99);
                scene.count(rays, counts, morphray::Crossing::once, {coherence});
                EXPECT_EQ(counts, expected_counts) << simd;
            }
        }
    }
}

TEST(Queries, OfRaysThatTakeLongAreAskedInShortRuns) {
    const std::atomic<bool> cancel = false;
    std::vector<std::size_t> runs;
    const auto run_all = [&](const Watch& watch, int us_of_ray) {
        runs.clear();
        for_watched_runs(0, 100, watch, 100, 10, [&](std::size_t, std::size_t count) {
            std::this_thread::sleep_for(std::chrono::microseconds(us_of_ray) * count);
            runs.push_back(count);
        });
        return runs;
    };
    EXPECT_EQ(run_all(Watch(&cancel), 400), std::vector<std::size_t>(10, 10));
    EXPECT_EQ(run_all({}, 400), std::vector<std::size_t>{100});
}

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
    // A cursor that is no hit.
    EXPECT_EQ(scene.intersect(ray, Hit{.t = -1, .prim_id = 0, .geom_id = 0}), first);
    EXPECT_EQ(scene.intersect_all({&ray, 1}, {.max_hits = 0}).left_out[0], 2u);
    // The same t, with a triangle that is before all of the scene.
    EXPECT_EQ(scene.intersect(ray, Hit{.t = first.t, .prim_id = 5, .geom_id = 0}), first);
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

TEST(VisibleHits, AreTheFirstOfAllHitsThatAreVisible) {
    for (const std::string& simd : morphray::simd_targets())
        expect_visible_hits_on(Device::cpu({.simd = simd}), 300);
    expect_visible_hits_on(Device::brute_force(), 60);
}

TEST(VisibleHits, AreThoseOfTheTreeInUse) {
    // The meshes of subtrees are found once for a tree. Each update moves it or makes another one.
    const morphray::Box bounds = {{-8, -8, -8}, {8, 8, 8}};
    for (const char* const policy : {"refit", "rebuild", "every:2"}) {
        std::vector<UserMesh> meshes = {UserMesh(star(3, 4)), UserMesh(icosphere(2)),
                                        UserMesh(icosphere(3))};
        morphray::SceneOptions options{.bounds = bounds};
        options.update = morphray::parse_update_policy(policy);
        Scene scene = Scene::build(views_of(meshes), Device::cpu(), options);
        const std::vector<Ray> rays = world_rays(meshes[0], 100, 3);
        const std::vector<Vec3> points(meshes[2].points.begin(), meshes[2].points.begin() + 50);
        Random random(4);
        for (std::uint32_t step = 0; step < 8; ++step) {
            if (step == 5) {
                scene.detach(1);
                meshes[1] = UserMesh(torus(12, 6));
                EXPECT_EQ(scene.attach(meshes[1].view()), 1u);
            }
            for (UserMesh& mesh : meshes) {
                const auto by = static_cast<float>(random.real(-1, 1));
                for (Vec3& p : mesh.points) p = {p.y + by, p.z, p.x - by / 2};
            }
            scene.update();
            const Scene brute = Scene::build(views_of(meshes), Device::brute_force(), options);
            const std::vector<std::uint8_t> visible = {step % 2 == 0, step % 3 == 0, step % 4 != 0};
            const morphray::QueryOptions sees{.visible = visible};
            for (const Ray& ray : rays)
                EXPECT_EQ(scene.intersect(ray, sees), brute.intersect(ray, sees));
            expect_same(scene.intersect_all(rays, {}, sees), brute.intersect_all(rays, {}, sees),
                        policy);
            EXPECT_TRUE(PointAnswers(scene, points, sees) == PointAnswers(brute, points, sees));
        }
    }
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

TEST(VisibleHits, LeaveOutTheTriangleOrMeshThatARayNames) {
    expect_excluded_on(Device::cpu(), 200);
    expect_excluded_on(Device::brute_force(), 40);
    const UserMesh mesh(star(3, 4));
    const Scene scene = Scene::build(mesh.view());
    const std::vector<Ray> rays(3);
    const std::vector<morphray::Primitive> two(2);
    std::vector<morphray::Hit> hits(rays.size());
    EXPECT_EQ(error_of([&] { scene.intersect(rays, hits, {.excluded = two}); }), "bad_argument");
    const std::vector<morphray::Vec3> points(3);
    std::vector<std::int32_t> windings(points.size());
    EXPECT_EQ(error_of([&] { scene.winding(points, windings, {.excluded = two}); }),
              "bad_argument");
}

TEST(VisibleHits, ExistAloneForPoints) {
    for (const std::string& simd : morphray::simd_targets())
        expect_filtered_points_on(Device::cpu({.simd = simd}), 100);
    expect_filtered_points_on(Device::brute_force(), 20);
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
        EXPECT_TRUE(std::ranges::equal(inside, std::array{1, 0, 1}));
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
    EXPECT_TRUE(std::ranges::equal(inside, std::array{0, 1, 1, 0}));
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
        const std::vector<std::uint8_t> hidden = {0};
        const PointAnswers nothing(scene, points, {.visible = hidden});
        EXPECT_FALSE(nothing.closest[3]);
        EXPECT_EQ(nothing.distances[3], kInfinity);
        EXPECT_EQ(nothing.inside[3], 0);
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
