// "Closed stays closed" (docs/design/arithmetic.md): no ray leaves a mesh that is combinatorially
// closed, whatever its shape. MORPHRAY_CLOSED_ROUNDS=200 makes it a long run of some 10^8 rays.
#include <gtest/gtest.h>

#include <cstdlib>

#include "common/bvh_builder.h"
#include "common/interop/surface.h"
#include "common/triangle_area.h"
#include "cpu/brute_tracer.h"
#include "cpu/refit.h"
#include "cpu/scalar_tracer.h"
#include "cpu/wide_tracer.h"
#include "tests/support/closed_joints.h"
#include "tests/support/closed_poses.h"

namespace morphray::test {
namespace {

struct ClosedCase {
    vec3 centre;
    double scale;
    std::uint32_t joints, collapses;
};

const ClosedCase kCases[] = {
    {{0, 0, 0}, 1, 200, 0},         {{0, 0, 0}, 1, 200, 40},       {{0, 0, 0}, 1e-38, 200, 20},
    {{0, 0, 0}, 1e30, 200, 20},     {{10, -7, 3}, 1, 200, 20},     {{1e3, 1e3, -2e3}, 1, 200, 20},
    {{1e5, 0, 0}, 1, 200, 0},       {{1e5, 1e5, 1e5}, 1, 200, 20}, {{-3e5, 1e5, 0}, 1e-20, 100, 0},
    {{1e6, 1e6, -1e6}, 1, 100, 10},
};

int rounds() {
    const char* const text = std::getenv("MORPHRAY_CLOSED_ROUNDS");
    return text != nullptr ? std::max(1, std::atoi(text)) : 10;
}

class ClosedMeshOn : public testing::TestWithParam<cpu::SimdTarget> {};
INSTANTIATE_TEST_SUITE_P(Targets, ClosedMeshOn, testing::ValuesIn(cpu::supported_simd_targets()),
                         [](const auto& parameter) { return std::string(parameter.param.name); });

TEST_P(ClosedMeshOn, LetsNoRayOutAtJointsAndCollapsedVertices) {
    std::size_t leaks = 0;
    for (int round = 0; round < rounds(); ++round) {
        std::uint64_t seed = 1000 * static_cast<std::uint64_t>(round);
        for (const ClosedCase& one : kCases) {
            const TestScene scene =
                sphere_with_joints(3, one.joints, one.collapses, one.scale, one.centre, ++seed);
            ASSERT_TRUE(is_closed(scene.topology().triangles));
            const Bvh bvh = build_bvh(scene.topology(), scene.positions());
            const cpu::WideTracer tracer(bvh, GetParam());
            Random random(seed);
            const double user[3] = {one.centre.x * one.scale, one.centre.y * one.scale,
                                    one.centre.z * one.scale};
            const vec3 centre = scene.space().point_to_scene(user, "centre");
            const std::vector<Ray> rays = rays_at_joints(scene, centre, one.scale, 10000, random);
            std::vector<Hit> hits(rays.size());
            std::vector<std::uint8_t> occluded(rays.size());
            tracer.intersect(rays, hits);
            tracer.occluded(rays, occluded);
            for (std::size_t i = 0; i < rays.size(); ++i)
                leaks += (hits[i].prim_id == kNoPrim) + (occluded[i] == 0);
        }
    }
    EXPECT_EQ(leaks, 0u);
}

TEST_P(ClosedMeshOn, LetsNoRayOutAtJointsAfterRefits) {
    const TestScene scene = sphere_with_joints(3, 300, 0, 1, {0, 0, 0}, 7);
    Bvh bvh = build_bvh(scene.topology(), scene.positions());
    const cpu::WideTracer tracer(bvh, GetParam());
    Random random(8);
    std::size_t leaks = 0;
    std::vector<Hit> hits(1000);
    for (int pose = 0; pose < 50 * rounds(); ++pose) {
        const std::vector<vec3> positions = breathing(scene.positions(), random);
        cpu::refit(bvh, positions);
        const std::vector<Ray> rays = rays_from_inside(scene, positions, hits.size(), random);
        tracer.intersect(rays, hits);
        for (const Hit& hit : hits) leaks += hit.prim_id == kNoPrim;
    }
    EXPECT_EQ(leaks, 0u);
}

TEST(ClosedMesh, IsClosedByTrianglesWithoutArea) {
    // Float rounding at this offset makes fillers collinear.
    const TestScene scene = sphere_with_joints(3, 300, 0, 1, {1e5, 1e5, 1e5}, 3);
    const cpu::BruteTracer brute(scene.topology(), scene.positions());
    Random random(9);
    const double user[3] = {1e5, 1e5, 1e5};
    const vec3 centre = scene.space().point_to_scene(user, "centre");
    std::size_t fillers = 0;
    for (const Ray& ray : rays_at_joints(scene, centre, 1, 3000, random)) {
        const Hit hit = brute.intersect(ray);
        ASSERT_NE(hit.prim_id, kNoPrim);
        EXPECT_GT(hit.t, 0.0f);
        EXPECT_GE(hit.u, 0.0f);
        EXPECT_GE(hit.v, 0.0f);
        EXPECT_LE(hit.u, 1.0f);
        EXPECT_LE(hit.v, 1.0f);
        const uvec3 t = scene.topology().triangles[hit.prim_id];
        const auto& p = scene.positions();
        if (has_area(p[t.x], p[t.y], p[t.z])) continue;
        ++fillers;
        const Surface surface = surface_at(ray, hit, p[t.x], p[t.y], p[t.z]);
        EXPECT_NEAR(dot3(surface.normal, surface.normal), 1, 1e-6);
        EXPECT_LE(dot3(surface.normal, ray.dir), 0.0f);
    }
    EXPECT_GT(fillers, 0u);
}

TEST(Surface, OfATriangleWhoseEdgesHaveNoCrossProductFacesTheRay) {
    const Ray ray{{0, 0, 8}, 0, {0.25f, 0.5f, -1}, kInfiniteT};
    const Hit hit{8, 0.5f, 0.25f, 0};
    const Surface surface = surface_at(ray, hit, {0, 0, 0}, {1, 2, 3}, {2, 4, 6});
    const vec3 against = unit(ray.dir);
    EXPECT_EQ(surface.normal, -against);
    EXPECT_EQ(surface.point, vec3(2, 4, 0));
}

}  // namespace
}  // namespace morphray::test
