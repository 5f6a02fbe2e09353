// "Closed stays closed" (docs/design/arithmetic.md): no ray leaves a mesh that is combinatorially
// closed, whatever its shape. MORPHRAY_CLOSED_ROUNDS=200 makes it a long run of some 10^8 rays.
// Surfaces keep their own shadow off.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "common/bvh/builder/bvh_builder.h"
#include "common/interop/camera.h"
#include "common/interop/surface.h"
#include "common/scene/camera_setup.h"
#include "common/scene/mesh.h"
#include "cpu/reference/scalar_tracer.h"
#include "cpu/refit/refit.h"
#include "cpu/single_ray/single_ray_tracer.h"
#include "scenes/procedural/procedural.h"
#include "tests/support/animation_positions.h"
#include "tests/support/test_scene.h"

namespace mray::test {
namespace {

/// Splits edge k of triangle i at a random place of it, and fills the crack to the other triangle.
void add_joint(Shape& mesh, std::size_t i, int k, Random& random) {
    const uvec3 old = mesh.triangles[i];
    const std::uint32_t p = old[k];
    const std::uint32_t q = old[(k + 1) % 3];
    const std::uint32_t r = old[(k + 2) % 3];
    const auto m = static_cast<std::uint32_t>(mesh.positions.size());
    const double at = random.below(2) == 0 ? 0.5 : random.real(0, 1);
    const dvec3 a = mesh.positions[p];
    mesh.positions.push_back(a + (mesh.positions[q] - a) * at);
    mesh.triangles[i] = {p, m, r};
    mesh.triangles.push_back({m, q, r});
    mesh.triangles.push_back({p, q, m});
}

/// A sphere of radius 1 around `centre` in which `joints` times an edge gets a vertex that only one
/// of its two triangles uses, and a triangle fills the crack; after that `collapses` vertices are
/// moved to a neighbour. Each directed edge has its opposite, so the mesh is closed; float rounding
/// at `centre` makes fillers, and other triangles, collinear. Positions are multiplied by `scale`.
TestScene sphere_with_joints(int levels, std::uint32_t joints, std::uint32_t collapses,
                             double scale, const vec3& centre, std::uint64_t seed) {
    Random random(seed);
    Shape mesh = shapes::icosphere(levels);
    for (std::uint32_t n = 0; n < joints; ++n) {
        const std::uint32_t i = random.below(static_cast<std::uint32_t>(mesh.triangles.size()));
        add_joint(mesh, i, static_cast<int>(random.below(3)), random);
    }
    for (dvec3& p : mesh.positions) p = (p + dvec3(centre)) * scale;
    for (std::uint32_t n = 0; n < collapses; ++n) {
        const uvec3 t = random.pick(mesh.triangles);
        mesh.positions[t.x] = mesh.positions[t.y];
    }
    return mesh;
}

/// From up to `jitter` beside `centre`: at vertices, at points of edges, at places inside
/// triangles.
std::vector<Ray> rays_from(const vec3& centre, double jitter, const TestScene& scene,
                           const std::vector<vec3>& p, std::size_t count, Random& random) {
    std::vector<Ray> rays;
    while (rays.size() < count) {
        const uvec3 t = random.pick(scene.topology().triangles);
        const auto part = [&] { return static_cast<float>(random.real(0, 1)); };
        const float f = rays.size() % 3 == 0 ? 0.0f : part();
        const float g = rays.size() % 3 != 2 ? 0.0f : (1 - f) * part();
        const vec3 target = p[t.x] + (p[t.y] - p[t.x]) * f + (p[t.z] - p[t.x]) * g;
        const vec3 org = snap_point(centre + random.point(jitter));
        const vec3 dir = target - org;
        if (dir == vec3(0, 0, 0)) continue;
        rays.push_back({org, 0, canonical_direction(dir), kInfiniteT});
    }
    return rays;
}

/// The vertices of a mesh around 0, each moved along its own way from 0 by up to a third: no two
/// triangles ever overlap as seen from 0.
std::vector<vec3> breathing(const std::vector<vec3>& positions, Random& random) {
    std::vector<vec3> moved;
    for (const vec3& p : positions)
        moved.push_back(snap_point(p * static_cast<float>(random.real(2.0 / 3, 1))));
    return moved;
}

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

class ClosedMeshOn : public testing::TestWithParam<SimdTarget> {
protected:
    /// The number of rays without a hit, and of rays that are not occluded.
    static std::size_t count_leaks(const Bvh& bvh, const std::vector<Ray>& rays) {
        const cpu::SingleRayTracer tracer(bvh, GetParam());
        std::vector<Hit> hits(rays.size());
        std::vector<std::uint8_t> occluded(rays.size());
        tracer.intersect(rays, hits);
        tracer.occluded(rays, occluded);
        std::size_t leaks = 0;
        for (std::size_t i = 0; i < rays.size(); ++i)
            leaks += (hits[i].prim_id == kNoPrim) + (occluded[i] == 0);
        return leaks;
    }
};
INSTANTIATE_TEST_SUITE_P(Targets, ClosedMeshOn, testing::ValuesIn(supported_simd_targets()),
                         [](const auto& parameter) { return std::string(parameter.param.name); });

TEST_P(ClosedMeshOn, LetsNoRayOutAtJointsAndCollapsedVertices) {
    std::size_t leaks = 0;
    for (int round = 0; round < rounds(); ++round) {
        std::uint64_t seed = 1000 * static_cast<std::uint64_t>(round);
        for (const ClosedCase& one : kCases) {
            const TestScene scene =
                sphere_with_joints(3, one.joints, one.collapses, one.scale, one.centre, ++seed);
            ASSERT_EQ(count_edges(scene.topology(), scene.positions()).uneven, 0u);
            const Bvh bvh = build_bvh(scene.topology(), scene.positions());
            Random random(seed);
            const vec3 centre =
                scene.space().point_to_scene(dvec3(one.centre) * one.scale, "centre");
            const double jitter = 0.01 * scene.space().length_to_scene(one.scale);
            leaks += count_leaks(
                bvh, rays_from(centre, jitter, scene, scene.positions(), 10000, random));
        }
    }
    EXPECT_EQ(leaks, 0u);
}

TEST_P(ClosedMeshOn, LetsNoRayOutAtJointsAfterRefits) {
    const TestScene scene = sphere_with_joints(3, 300, 0, 1, {0, 0, 0}, 7);
    Bvh bvh = build_bvh(scene.topology(), scene.positions());
    Random random(8);
    std::size_t leaks = 0;
    for (int pose = 0; pose < 50 * rounds(); ++pose) {
        const std::vector<vec3> positions = breathing(scene.positions(), random);
        cpu::refit(bvh, positions);
        leaks += count_leaks(
            bvh, rays_from(vec3(0), 0.01 * kSceneExtent, scene, positions, 1000, random));
    }
    EXPECT_EQ(leaks, 0u);
}

TEST_P(ClosedMeshOn, LetsNoRayOutAlongAxesThroughVertices) {
    const TestScene scene = grid_box(16);
    std::vector<Ray> rays;
    for (const vec3& vertex : scene.positions()) {
        for (int axis = 0; axis < 3; ++axis) {
            vec3 org = vertex;
            org[axis] = 0;
            if (org == vertex || largest_component(org) > 0.95f * largest_component(vertex))
                continue;
            rays.push_back({org, 0, canonical_direction(vertex - org), kInfiniteT});
        }
    }
    EXPECT_GT(rays.size(), 1000u);
    EXPECT_EQ(count_leaks(build_bvh(scene.topology(), scene.positions()), rays), 0u);
}

TEST_P(ClosedMeshOn, ShowsItsFarSideFromVerticesAndFaces) {
    const TestScene scene = icosphere(4);
    const std::vector<vec3>& p = scene.positions();
    Random random(22);
    std::vector<Ray> rays;
    for (int i = 0; i < 50000; ++i) {
        const uvec3 t = random.pick(scene.topology().triangles);
        const vec3 org = i % 2 == 0 ? p[t.x] : snap_point((p[t.x] + p[t.y] + p[t.z]) * (1.0f / 3));
        // Some way off the surface, so that the ray runs inside.
        const vec3 way = random.pick(p) - org;
        if (dot3(way, way) < 0.01f * kSceneExtent * kSceneExtent) continue;
        rays.push_back({org, 0, canonical_direction(way), kInfiniteT});
    }
    EXPECT_GT(rays.size(), 40000u);
    EXPECT_EQ(count_leaks(build_bvh(scene.topology(), p), rays), 0u);
}

TEST(ClosedMesh, IsClosedByATriangleWithoutArea) {
    // A tetrahedron with one edge, 0 to 1, whose exact middle 4 is a vertex of one side alone.
    const std::vector<vec3> positions = {
        {7, 5, 3}, {-5, 7, -3}, {3, -7, 5}, {-5, -3, -7}, {1, 6, 0}};
    std::vector<uvec3> triangles = {{0, 4, 2}, {4, 1, 2}, {0, 3, 1}, {1, 3, 2}, {2, 3, 0}};
    const TestScene open(positions, triangles);
    const auto filler = static_cast<std::uint32_t>(triangles.size());
    triangles.push_back({0, 1, 4});
    const TestScene closed(positions, triangles);
    const std::vector<vec3>& p = closed.positions();
    ASSERT_EQ(count_edges(closed.topology(), p).uneven, 0u);
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

/// Calls visit(tracer, ray, prim_id) for the shadow rays of what the pixels of an image see.
/// Returns their number.
template <class Visit>
std::size_t for_each_shadow_ray(const Topology& topology, std::span<const vec3> positions,
                                const ImageParams& params, Visit visit) {
    const Bvh bvh = build_bvh(topology, positions);
    const cpu::ScalarTracer tracer(bvh);
    std::size_t rays = 0;
    for (std::uint32_t y = 0; y < params.height; ++y) {
        for (std::uint32_t x = 0; x < params.width; ++x) {
            const Ray ray = camera_ray(params.camera, x, y);
            const Hit hit = tracer.intersect(ray);
            if (hit.prim_id == kNoPrim) continue;
            const uvec3 t = topology.triangles[hit.prim_id];
            const Surface surface =
                surface_at(ray, hit, positions[t.x], positions[t.y], positions[t.z]);
            if (!faces_light(surface, params.light)) continue;
            ++rays;
            visit(tracer, shadow_ray(surface, params.light), hit.prim_id);
        }
    }
    return rays;
}

TEST(ShadowRay, NeverMeetsTheTriangleThatItBelongsTo) {
    for (const ProceduralScene& builtin : procedural_scenes()) {
        std::size_t rays = 0;
        const auto animation = make_procedural(builtin.name, 4000);
        // At frame 10 the collapse lies in a plane.
        for (const double part : {0.0, 0.3, 10.0 / 24, 0.5}) {
            std::vector<vec3> positions = positions_at(
                *animation, std::lerp(animation->first_frame(), animation->last_frame(), part));
            PoseExtent pose;
            pose.add(positions);
            const SceneSpace space = space_of_pose(animation->bounds(), pose);
            space.to_scene(positions, positions);
            rays += for_each_shadow_ray(
                animation->topology(), positions,
                make_image_params({.width = 128, .height = 128}, animation->bounds(), space),
                [&](const cpu::ScalarTracer& tracer, const Ray& ray, std::uint32_t prim_id) {
                    EXPECT_NE(tracer.intersect(ray).prim_id, prim_id) << builtin.name;
                });
        }
        EXPECT_GT(rays, 1000u) << builtin.name;
    }
}

TEST(ShadowRay, LeavesAConvexSurfaceInTheLight) {
    for (const TestScene& scene : {icosphere(4), icosphere(4, 1e-12), icosphere(4, 1e12),
                                   icosphere(3, 1, {1000, -2000, 500})}) {
        const ImageParams params = make_image_params(
            {.width = 192, .height = 192}, bounds_of(scene.world_positions()), scene.space());
        const std::size_t rays =
            for_each_shadow_ray(scene.topology(), scene.positions(), params,
                                [](const cpu::ScalarTracer& tracer, const Ray& ray, std::uint32_t) {
                                    EXPECT_FALSE(tracer.occluded(ray));
                                });
        EXPECT_GT(rays, 1000u);
    }
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
