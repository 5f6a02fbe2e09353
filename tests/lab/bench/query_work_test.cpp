#include "lab/bench/query_work.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "common/interop/closest_rule.h"
#include "tests/support/test_scene.h"

namespace mray::bench {
namespace {

BenchScene open(const std::string& spec) {
    ViewSpec view;
    view.width = view.height = 32;
    return open_bench_scene(spec, view);
}

float distance_from(const BenchScene& scene, vec3 p) {
    float d2 = std::numeric_limits<float>::infinity();
    for (const uvec3& t : scene.topology().triangles) {
        d2 = std::min(d2, triangle_distance2(p, scene.positions[t.x], scene.positions[t.y],
                                             scene.positions[t.z]));
    }
    return std::sqrt(d2);
}

TEST(QueryWork, PointsAreTheSameOnEachCallAndWhereTheyAreSaidToBe) {
    const BenchScene scene = open("builtin:spikes:500");
    const std::vector<vec3> in_box = points_in_box(scene, 300);
    const std::vector<vec3> near = points_near_surface(scene, 300);
    EXPECT_EQ(in_box, points_in_box(scene, 300));
    EXPECT_EQ(near, points_near_surface(scene, 300));
    vec3 lower = scene.positions[0];
    vec3 upper = scene.positions[0];
    for (const vec3& p : scene.positions) {
        for (int axis = 0; axis < 3; ++axis) {
            lower[axis] = std::min(lower[axis], p[axis]);
            upper[axis] = std::max(upper[axis], p[axis]);
        }
    }
    const vec3 sides = upper - lower;
    const float longest = std::max(sides.x, std::max(sides.y, sides.z));
    int far_in_box = 0;
    for (const vec3& p : in_box) {
        for (int axis = 0; axis < 3; ++axis) {
            EXPECT_GE(p[axis], lower[axis]);
            EXPECT_LE(p[axis], upper[axis]);
        }
        far_in_box += distance_from(scene, p) > 0.02f * longest;
    }
    EXPECT_GT(far_in_box, 100);
    for (const vec3& p : near) EXPECT_LE(distance_from(scene, p), 0.0174f * longest);
}

TEST(QueryWork, VerticesThatAreNotFiniteLeavePointsAndRaysFinite) {
    const BenchScene scene = open("builtin:soup");
    for (const vec3& p : points_near_surface(scene, 1000))
        EXPECT_TRUE(std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z));
    for (const Ray& ray : random_rays(scene, 1000)) {
        EXPECT_TRUE(std::isfinite(ray.org.x) && std::isfinite(ray.org.y));
        EXPECT_GT(glm::dot(ray.dir, ray.dir), 0);
    }
}

TEST(QueryWork, EricsonFindsTheDistancesOfTheRule) {
    test::Random random(1);
    for (int i = 0; i < 10000; ++i) {
        const vec3 p = random.point();
        const vec3 a = random.point();
        const vec3 b = random.point();
        const vec3 c = random.point();
        const float ours = std::sqrt(triangle_distance2(p, a, b, c));
        EXPECT_NEAR(ours, glm::distance(p, ericson_closest_point(p, a, b, c)), 1e-5f);
    }
}

}  // namespace
}  // namespace mray::bench
