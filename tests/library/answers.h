// Every answer that a scene gives about points and all hits, to compare devices and trees by.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "tests/library/scenes.h"

namespace mray::test {

/// The answers of a scene to all questions about points.
struct PointAnswers {
    std::vector<std::int32_t> windings;
    std::vector<std::uint8_t> inside;
    std::vector<morphray::ClosestPoint> closest;
    std::vector<float> distances;

    PointAnswers(const morphray::Scene& scene, const std::vector<morphray::Vec3>& points,
                 const morphray::QueryOptions& options = {})
        : windings(points.size()),
          inside(points.size()),
          closest(points.size()),
          distances(points.size()) {
        using Limits = std::numeric_limits<float>;
        scene.winding(points, windings, options);
        scene.contains(points, inside, morphray::FillRule::odd, options);
        scene.closest_points(points, closest, Limits::infinity(), options);
        scene.signed_distance(points, distances, morphray::FillRule::nonzero, Limits::infinity(),
                              options);
    }
    /// The answers about point i alone.
    PointAnswers of(std::size_t i) const {
        PointAnswers one = *this;
        one.windings = {windings[i]};
        one.inside = {inside[i]};
        one.closest = {closest[i]};
        one.distances = {distances[i]};
        return one;
    }
    bool operator==(const PointAnswers&) const = default;
};

inline void expect_same(const morphray::AllHits& a, const morphray::AllHits& b,
                        const std::string& what) {
    EXPECT_EQ(a.offsets, b.offsets) << what;
    EXPECT_EQ(a.left_out, b.left_out) << what;
    EXPECT_EQ(a.hits, b.hits) << what;
}

/// A scene on each device answers as on the CPU, for three poses, refitted and by brute force.
inline void expect_same_answers_on(const std::vector<morphray::Device>& devices) {
    const TestScene shape = star(4, 8);
    UserMesh mesh(shape);
    std::vector<morphray::Vec3> points = {mesh.points.front()};
    for (const vec3& p : mixed_points(shape, 3000, 3)) {
        const vec3 world = shape.space().to_world(p);
        points.push_back({world.x, world.y, world.z});
    }
    const std::vector<morphray::Ray> rays = world_rays(mesh, 300, 6);
    morphray::SceneOptions options;
    options.bounds = morphray::Box{{-4, -4, -4}, {4, 4, 4}};
    options.update = morphray::Refit{};
    morphray::Scene scene = morphray::Scene::build(mesh.view(), morphray::Device::cpu(), options);
    std::vector<morphray::Scene> others;
    for (const morphray::Device& device : devices) others.push_back(scene.on(device));
    Random random(1);
    for (int pose = 0; pose < 3; ++pose) {
        for (morphray::Vec3& p : mesh.points) {
            const auto size = static_cast<float>(random.real(0.8, 1.25));
            p = {p.x * size, p.y * size, p.z * size};
        }
        scene.update();
        const PointAnswers expected(scene, points);
        const morphray::AllHits hits = scene.intersect_all(rays);
        for (morphray::Scene& other : others) {
            other.update();
            EXPECT_TRUE(PointAnswers(other, points) == expected) << other.device().description();
            expect_same(other.intersect_all(rays), hits, other.device().description());
        }
        const morphray::Scene built =
            morphray::Scene::build(mesh.view(), morphray::Device::brute_force(), options);
        const std::vector<morphray::Vec3> some(points.begin(), points.begin() + 200);
        EXPECT_TRUE(PointAnswers(built, some) == PointAnswers(scene, some));
    }
}

/// Rays that see some meshes hit what brute force hits in a scene that has no others.
inline void expect_visible_hits_on(const morphray::Device& device, std::size_t ray_count) {
    const UserMesh spikes(star(3, 4));
    const UserMesh ball(icosphere(2));
    const UserMesh ring(torus(20, 10));
    const std::vector<morphray::MeshView> meshes = {spikes.view(), ball.view(), ring.view(),
                                                    spikes.view(), ball.view()};
    const morphray::SceneOptions options{.bounds = morphray::Box{{-4, -4, -4}, {4, 4, 4}}};
    morphray::Scene scene = morphray::Scene::build(meshes, device, options);
    constexpr std::size_t kDetached = 1;
    scene.detach(kDetached);
    scene.update();
    const std::vector<morphray::Ray> rays = world_rays(spikes, ray_count, 7);
    const std::vector<std::vector<std::uint8_t>> sets = {
        {0, 0, 0, 0, 0}, {1, 0, 0, 0, 0}, {0, 1, 1, 0, 0}, {0, 0, 0, 1, 0}, {0, 0, 2, 0, 1}};
    std::size_t hit_count = 0;
    for (const std::vector<std::uint8_t>& visible : sets) {
        std::vector<morphray::MeshView> seen(meshes.size());
        for (std::size_t i = 0; i < meshes.size(); ++i)
            if (visible[i] != 0 && i != kDetached) seen[i] = meshes[i];
        const morphray::Scene rest =
            morphray::Scene::build(seen, morphray::Device::brute_force(), options);
        const morphray::QueryOptions sees{.visible = visible};
        for (const morphray::Ray& ray : rays) {
            const morphray::Hit expected = rest.intersect(ray);
            EXPECT_EQ(scene.intersect(ray, sees), expected);
            hit_count += expected ? 1 : 0;
        }
        std::vector<std::uint8_t> occluded(rays.size());
        scene.occluded(rays, occluded, sees);
        for (std::size_t i = 0; i < rays.size(); ++i)
            EXPECT_EQ(occluded[i] != 0, rest.occluded(rays[i]));
        expect_same(scene.intersect_all(rays, {.max_hits = 3}, sees),
                    rest.intersect_all(rays, {.max_hits = 3}), "visible");
    }
    EXPECT_GT(hit_count, ray_count / 2);
}

/// Rays that leave out the first triangle that they hit, or its mesh, have the answers of brute
/// force in a scene without it.
inline void expect_excluded_on(const morphray::Device& device, std::size_t ray_count) {
    const UserMesh mesh(star(3, 4));
    UserMesh turned_over = mesh;
    for (morphray::Vec3& p : turned_over.points) p = {p.y, -p.x, p.z};
    const std::vector<UserMesh> meshes = {mesh, turned_over, mesh};
    const morphray::SceneOptions options{.bounds = morphray::Box{{-4, -4, -4}, {4, 4, 4}}};
    const morphray::Scene scene = morphray::Scene::build(views_of(meshes), device, options);
    const std::vector<morphray::Ray> rays = world_rays(mesh, ray_count, 7);
    std::vector<morphray::Primitive> excluded;
    for (const morphray::Ray& ray : rays) excluded.push_back(scene.intersect(ray).primitive());
    for (std::size_t i = 0; i < rays.size(); i += 3) excluded[i].prim_id = morphray::kNoPrim;
    const morphray::QueryOptions options_of_rays{.excluded = excluded};
    std::vector<morphray::Hit> hits(rays.size());
    std::vector<std::uint8_t> occluded(rays.size());
    std::vector<std::uint64_t> counts(rays.size());
    scene.intersect(rays, hits, options_of_rays);
    scene.occluded(rays, occluded, options_of_rays);
    scene.count(rays, counts, morphray::Crossing::once, options_of_rays);
    const morphray::AllHits all = scene.intersect_all(rays, {.max_hits = 2}, options_of_rays);
    std::size_t hit_count = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        std::vector<UserMesh> rest = meshes;
        const auto [prim_id, geom_id] = excluded[i];
        if (prim_id != morphray::kNoPrim) {
            std::vector<std::uint32_t>& triangles = rest[geom_id].triangles;
            const std::size_t corner = std::size_t{3} * prim_id;
            triangles[corner + 1] = triangles[corner + 2] = triangles[corner];
        } else if (geom_id != morphray::kNoGeometry) {
            rest[geom_id].triangles.clear();
        }
        const morphray::Scene brute =
            morphray::Scene::build(views_of(rest), morphray::Device::brute_force(), options);
        const morphray::Hit expected = brute.intersect(rays[i]);
        EXPECT_EQ(hits[i], expected);
        EXPECT_EQ(occluded[i] != 0, static_cast<bool>(expected));
        const morphray::AllHits expected_all = brute.intersect_all({&rays[i], 1}, {.max_hits = 2});
        EXPECT_TRUE(std::ranges::equal(all.of_ray(i), expected_all.hits));
        EXPECT_EQ(all.left_out[i], expected_all.left_out[0]);
        EXPECT_EQ(counts[i], expected_all.hits.size() + expected_all.left_out[0]);
        hit_count += expected ? 1 : 0;
    }
    EXPECT_GT(hit_count, ray_count / 8);
}

/// Points that see some triangles have the answers of brute force in a scene without the others,
/// before and after an update with a pose.
inline void expect_filtered_points_on(const morphray::Device& device, std::size_t point_count) {
    const TestScene shape = star(3, 4);
    std::vector<UserMesh> meshes = {UserMesh(shape), UserMesh(icosphere(2)), UserMesh(shape)};
    // Each triangle is there twice.
    std::vector<std::uint32_t>& triangles = meshes[0].triangles;
    for (std::size_t i = 0, size = triangles.size(); i < size; ++i)
        triangles.push_back(triangles[i]);
    std::vector<morphray::Vec3> points = {{0, 0, 0}, {1e9f, 0, 2}, meshes[0].points[0]};
    for (const vec3& p : mixed_points(shape, point_count, 5)) {
        const vec3 world = shape.space().to_world(p);
        points.push_back({world.x, world.y, world.z});
    }
    const morphray::SceneOptions options{.bounds = morphray::Box{{-4, -4, -4}, {4, 4, 4}}};
    const auto scene_of = [&](const std::vector<UserMesh>& of, const morphray::Device& on) {
        return morphray::Scene::build(views_of(of), on, options);
    };
    morphray::Scene scene = scene_of(meshes, device);
    for (const morphray::Transform& pose : {turned(0, 1, 0), turned(0.5, -0.9, 0.4)}) {
        for (morphray::Vec3& p : meshes[0].points) p = {p.y, 1.1f * p.x, p.z};
        scene.update();
        scene.update(2, pose);
        const auto answers_of = [&](const std::vector<UserMesh>& rest, const auto& asked) {
            morphray::Scene brute = scene_of(rest, morphray::Device::brute_force());
            brute.update(2, pose);
            return PointAnswers(brute, asked);
        };
        std::vector<PointAnswers> expected;
        for (std::size_t hidden = 0; hidden < meshes.size(); ++hidden) {
            std::vector<UserMesh> rest = meshes;
            rest[hidden].triangles.clear();
            expected.push_back(answers_of(rest, points));
            std::vector<std::uint8_t> visible(meshes.size(), 1);
            visible[hidden] = 0;
            EXPECT_TRUE(PointAnswers(scene, points, {.visible = visible}) == expected.back());
        }
        std::vector<morphray::Primitive> excluded(points.size());
        for (std::uint32_t i = 0; i < points.size(); ++i) excluded[i].geom_id = i % 3;
        const PointAnswers without_mesh(scene, points, {.excluded = excluded});
        for (std::size_t i = 0; i < points.size(); ++i)
            EXPECT_TRUE(without_mesh.of(i) == expected[i % 3].of(i)) << i;
        const PointAnswers all(scene, points);
        for (std::size_t i = 0; i < points.size(); ++i)
            excluded[i] = {all.closest[i].prim_id, all.closest[i].geom_id};
        const PointAnswers without_closest(scene, points, {.excluded = excluded});
        for (std::size_t i = 0; i < std::min<std::size_t>(points.size(), 20); ++i) {
            std::vector<UserMesh> rest = meshes;
            UserMesh& mesh = rest[excluded[i].geom_id];
            constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
            for (std::size_t corner = 0; corner < 3; ++corner)
                mesh.triangles[std::size_t{3} * excluded[i].prim_id + corner] =
                    static_cast<std::uint32_t>(mesh.points.size());
            mesh.points.push_back({kNan, kNan, kNan});
            EXPECT_TRUE(without_closest.of(i) == answers_of(rest, std::vector{points[i]})) << i;
        }
    }
}

/// Calls of every member of a scene that can be cancelled, by `flag` as it is then. All of what the
/// calls use must outlive them.
class CancelledCalls {
public:
    CancelledCalls(const morphray::Scene& scene, const std::vector<morphray::Ray>& rays,
                   const std::vector<morphray::Vec3>& points)
        : hits_(rays.size(), kUntouched),
          counts_(rays.size(), kUntouchedCount),
          bytes_(rays.size()),
          windings_(points.size()),
          closest_(points.size()),
          distances_(points.size()) {
        using morphray::Coherence;
        using morphray::Crossing;
        using morphray::FillRule;
        constexpr float kFar = std::numeric_limits<float>::infinity();
        calls = {
            {"intersect", [&] { scene.intersect(rays, hits_, {.cancel = flag}); }},
            {"intersect sorted",
             [&] {
                 scene.intersect(rays, hits_, {Coherence::sort(), {}, {}, {}, flag});
             }},
            {"occluded", [&] { scene.occluded(rays, bytes_, {.cancel = flag}); }},
            {"compare", [&] { compare(scene, scene, rays, 10, {.cancel = flag}); }},
            {"intersect_all", [&] { scene.intersect_all(rays, {}, {.cancel = flag}); }},
            {"count", [&] { scene.count(rays, counts_, Crossing::once, {.cancel = flag}); }},
            {"count sorted",
             [&] {
                 scene.count(rays, counts_, Crossing::once, {Coherence::sort(), {}, {}, {}, flag});
             }},
            {"winding", [&] { scene.winding(points, windings_, {.cancel = flag}); }},
            {"contains", [&] { scene.contains(points, bytes_, FillRule::odd, {.cancel = flag}); }},
            {"closest_points",
             [&] { scene.closest_points(points, closest_, kFar, {.cancel = flag}); }},
            {"signed_distance",
             [&] {
                 scene.signed_distance(points, distances_, FillRule::odd, kFar, {.cancel = flag});
             }},
        };
    }
    CancelledCalls(const CancelledCalls&) = delete;

    /// Whether no call has written hits or counts.
    bool left_all_alone() const {
        const auto n = static_cast<std::ptrdiff_t>(hits_.size());
        return std::ranges::count(hits_, kUntouched) == n &&
               std::ranges::count(counts_, kUntouchedCount) == n;
    }

    std::vector<std::pair<const char*, std::function<void()>>> calls;
    const std::atomic<bool>* flag = nullptr;

private:
    static constexpr morphray::Hit kUntouched{-1, -2, -3, 77, 88};
    static constexpr std::uint64_t kUntouchedCount = 99;

    std::vector<morphray::Hit> hits_;
    std::vector<std::uint64_t> counts_;
    std::vector<std::uint8_t> bytes_;
    std::vector<std::int32_t> windings_;
    std::vector<morphray::ClosestPoint> closest_;
    std::vector<float> distances_;
};

/// Every question, about nothing as well, is cancelled on a device by a flag that is true before.
inline void expect_all_are_cancelled_on(const morphray::Device& device) {
    UserMesh mesh(icosphere(1));
    const morphray::Scene scene = morphray::Scene::build(mesh.view(), device);
    const std::atomic<bool> cancelled = true;
    for (const std::size_t count : {0, 1, 1000}) {
        const std::vector<morphray::Ray> rays(count, {.org = {0, 0, 0}, .dir = {0, 0, 1}});
        const std::vector<morphray::Vec3> points(count);
        CancelledCalls all(scene, rays, points);
        all.flag = &cancelled;
        for (const auto& [name, call] : all.calls)
            EXPECT_EQ(error_of(call), "cancelled") << name << " of " << count;
        EXPECT_TRUE(all.left_all_alone()) << count;
    }
}

}  // namespace mray::test
