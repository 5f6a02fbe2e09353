// "Closed stays closed" (docs/design/arithmetic.md): no ray leaves a mesh that is combinatorially
// closed, whatever its shape. MORPHRAY_CLOSED_ROUNDS=200 makes it a long run of some 10^8 rays.
#include <gtest/gtest.h>

#include <cstdlib>

#include "common/bvh/builder/bvh_builder.h"
#include "common/interop/surface.h"
#include "common/scene/triangle_area.h"
#include "cpu/reference/brute_tracer.h"
#include "cpu/reference/scalar_tracer.h"
#include "cpu/refit/refit.h"
#include "cpu/single_ray/single_ray_tracer.h"
#include "tests/support/closed_joints.h"
#include "tests/support/closed_poses.h"

namespace mray::test {
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

class ClosedMeshOn : public testing::TestWithParam<SimdTarget> {};
INSTANTIATE_TEST_SUITE_P(Targets, ClosedMeshOn, testing::ValuesIn(supported_simd_targets()),
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
            const cpu::SingleRayTracer tracer(bvh, GetParam());
            Random random(seed);
            const double world[3] = {one.centre.x * one.scale, one.centre.y * one.scale,
                                     one.centre.z * one.scale};
            const vec3 centre = scene.space().point_to_scene(world, "centre");
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
    const cpu::SingleRayTracer tracer(bvh, GetParam());
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

TEST(ClosedMesh, IsClosedByATriangleWithoutArea) {
    // A tetrahedron with one edge, 0 to 1, whose exact middle 4 is a vertex of one side alone.
    const std::vector<vec3> positions = {
        {7, 5, 3}, {-5, 7, -3}, {3, -7, 5}, {-5, -3, -7}, {1, 6, 0}};
    std::vector<uvec3> triangles = {{0, 4, 2}, {4, 1, 2}, {0, 3, 1}, {1, 3, 2}, {2, 3, 0}};
    const TestScene open(positions, triangles);
    const auto filler = static_cast<std::uint32_t>(triangles.size());
    triangles.push_back({0, 1, 4});
    ASSERT_TRUE(is_closed(triangles));
    const TestScene closed(positions, triangles);
    const std::vector<vec3>& p = closed.positions();
    ASSERT_FALSE(has_area(p[0], p[1], p[4]));
    const cpu::BruteTracer with(closed.topology(), p);
    const cpu::BruteTracer without(open.topology(), open.positions());
    Random random(9);
    std::size_t leaks = 0;
    std::size_t fillings = 0;
    for (int i = 0; i < 100000; ++i) {
        const vec3 org = snap_point(random.point(0.05 * kSceneExtent));
        const vec3 target = p[0] + (p[1] - p[0]) * static_cast<float>(random.real(0, 1));
        const Ray ray{org, 0, canonical_direction(target - org), kInfiniteT};
        leaks += without.intersect(ray).prim_id == kNoPrim;
        const Hit hit = with.intersect(ray);
        ASSERT_NE(hit.prim_id, kNoPrim);
        EXPECT_GT(hit.t, 0.0f);
        EXPECT_GE(hit.u, 0.0f);
        EXPECT_GE(hit.v, 0.0f);
        // docs/design/arithmetic.md, "No denormals".
        EXPECT_LE(hit.u, 1 + 0x1p-21f);
        EXPECT_LE(hit.v, 1 + 0x1p-21f);
        fillings += hit.prim_id == filler;
    }
    // The crack is there, and the triangle fills it.
    EXPECT_GT(leaks, 0u);
    EXPECT_GE(fillings, leaks);
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
}  // namespace mray::test
