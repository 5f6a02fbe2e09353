// Every answer that a scene gives about points and all hits, to compare devices and trees by.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <vector>

#include "tests/library/scenes.h"
#include "tests/support/mixed_points.h"

namespace mray::test {

/// Points near and on a scene and far from it, in world space.
inline std::vector<morphray::Vec3> points_of(const UserMesh& mesh, const TestScene& scene,
                                             std::size_t count) {
    std::vector<morphray::Vec3> points;
    for (const vec3& p : mixed_points(scene.topology().triangles, scene.positions(), count, 3)) {
        const vec3 world = scene.space().to_world(p);
        points.push_back({world.x, world.y, world.z});
    }
    points.push_back(mesh.points.front());
    return points;
}

/// The answers of a scene to all questions about points.
struct PointAnswers {
    std::vector<std::int32_t> windings;
    std::vector<std::uint8_t> inside;
    std::vector<morphray::ClosestPoint> closest;
    std::vector<float> distances;

    PointAnswers(const morphray::Scene& scene, const std::vector<morphray::Vec3>& points)
        : windings(points.size()),
          inside(points.size()),
          closest(points.size()),
          distances(points.size()) {
        scene.winding(points, windings);
        scene.contains(points, inside);
        scene.closest_points(points, closest);
        scene.signed_distance(points, distances);
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
    const std::vector<morphray::Vec3> points = points_of(mesh, shape, 3000);
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

}  // namespace mray::test
