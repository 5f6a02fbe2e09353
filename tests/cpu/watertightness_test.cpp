// Surfaces stay closed and keep their own shadow off: from origins on vertices and faces, for
// lights on a surface.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "common/bvh/builder/bvh_builder.h"
#include "common/interop/camera.h"
#include "common/interop/surface.h"
#include "common/scene/camera_setup.h"
#include "cpu/cpu_backend.h"
#include "cpu/reference/scalar_tracer.h"
#include "scenes/procedural/procedural.h"
#include "tests/support/test_scene.h"

namespace mray::test {
namespace {

TEST(Watertight, SeesTheFarSideFromVerticesAndFaces) {
    const TestScene scene = icosphere(4);
    const Bvh bvh = build_bvh(scene.topology(), scene.positions());
    const cpu::ScalarTracer tracer(bvh);
    Random random(22);
    const auto vertex = [&] {
        const auto count = static_cast<std::uint32_t>(scene.positions().size());
        return scene.positions()[random.below(count)];
    };
    int traced = 0;
    for (int i = 0; i < 50000; ++i) {
        vec3 org = vertex();
        if (i % 2 == 1) {
            const auto count = static_cast<std::uint32_t>(scene.triangle_count());
            const uvec3 t = scene.topology().triangles[random.below(count)];
            const auto& p = scene.positions();
            org = snap_point((p[t.x] + p[t.y] + p[t.z]) * (1.0f / 3));
        }
        // Some way off the surface, so that the ray runs inside.
        const vec3 target = vertex();
        if (dot3(target - org, target - org) < 0.01f * kSceneExtent * kSceneExtent) continue;
        const Ray ray{org, 0, canonical_direction(target - org), kInfiniteT};
        ++traced;
        ASSERT_NE(tracer.intersect(ray).prim_id, kNoPrim);
    }
    EXPECT_GT(traced, 40000);
}

/// Calls visit(surface, prim_id) for what the pixels of an image see.
template <class Visit>
void for_each_surface(const Topology& topology, std::span<const vec3> positions, const Bvh& bvh,
                      const ImageParams& params, Visit visit) {
    const cpu::ScalarTracer tracer(bvh);
    for (std::uint32_t y = 0; y < params.height; ++y) {
        for (std::uint32_t x = 0; x < params.width; ++x) {
            const Ray ray = camera_ray(params.camera, x, y);
            const Hit hit = tracer.intersect(ray);
            if (hit.prim_id == kNoPrim) continue;
            const uvec3 t = topology.triangles[hit.prim_id];
            visit(surface_at(ray, hit, positions[t.x], positions[t.y], positions[t.z]),
                  hit.prim_id);
        }
    }
}

TEST(ShadowRay, NeverMeetsTheTriangleThatItBelongsTo) {
    for (const ProceduralScene& builtin : procedural_scenes()) {
        std::size_t rays = 0;
        const auto animation = make_procedural(builtin.name, 4000);
        ViewSpec view;
        view.width = view.height = 128;
        std::vector<vec3> world(animation->topology().vertex_count);
        std::vector<vec3> positions(world.size());
        // At frame 10 the collapse lies in a plane.
        for (const double part : {0.0, 0.3, 10.0 / 24, 0.5}) {
            animation->positions(std::lerp(animation->first_frame(), animation->last_frame(), part),
                                 world);
            PoseExtent pose;
            pose.add(world);
            const SceneSpace space = space_of_pose(animation->bounds(), pose);
            const ImageParams params = make_image_params(view, animation->bounds(), space);
            space.to_scene(world, positions);
            const Bvh bvh = build_bvh(animation->topology(), positions);
            const cpu::ScalarTracer tracer(bvh);
            for_each_surface(animation->topology(), positions, bvh, params,
                             [&](const Surface& surface, std::uint32_t prim_id) {
                                 if (!faces_light(surface, params.light)) return;
                                 ++rays;
                                 const Ray ray = shadow_ray(surface, params.light);
                                 EXPECT_NE(tracer.intersect(ray).prim_id, prim_id) << builtin.name;
                             });
        }
        EXPECT_GT(rays, 1000u) << builtin.name;
    }
}

TEST(ShadowRay, LeavesAConvexSurfaceInTheLight) {
    for (const TestScene& scene : {icosphere(4), icosphere(4, 1e-12), icosphere(4, 1e12),
                                   icosphere(3, 1, {1000, -2000, 500})}) {
        std::size_t rays = 0;
        const Bvh bvh = build_bvh(scene.topology(), scene.positions());
        const cpu::ScalarTracer tracer(bvh);
        ViewSpec view;
        view.width = view.height = 192;
        const ImageParams params =
            make_image_params(view, bounds_of(scene.world_positions()), scene.space());
        for_each_surface(scene.topology(), scene.positions(), bvh, params,
                         [&](const Surface& surface, std::uint32_t) {
                             if (!faces_light(surface, params.light)) return;
                             ++rays;
                             EXPECT_FALSE(tracer.occluded(shadow_ray(surface, params.light)));
                         });
        EXPECT_GT(rays, 1000u);
    }
}

TEST(ShadowImage, IsTheScalarOneForLightsOnVerticesOnFacesAndBehind) {
    const TestScene scene = torus(48, 24);
    const Bvh bvh = build_bvh(scene.topology(), scene.positions());
    const auto best = cpu::make_cpu_backend();
    const auto scalar = cpu::make_scalar_backend();
    best->set_scene(scene.topology(), scene.positions(), bvh);
    scalar->set_scene(scene.topology(), scene.positions(), bvh);
    const std::vector<vec3>& p = scene.world_positions();
    const uvec3 t = scene.topology().triangles[100];
    ViewSpec view;
    view.width = view.height = 96;
    view.rays = kRaysShadow;
    std::size_t dark = 0;
    for (const vec3 light :
         {p[0], p[t.y], (p[t.x] + p[t.y] + p[t.z]) * (1.0f / 3), vec3(-1, -1, -3), vec3(0, 0, 0)}) {
        view.light = Point{light.x, light.y, light.z};
        const ImageParams params = make_image_params(view, bounds_of(p), scene.space());
        Frame expected;
        Frame actual;
        scalar->trace_image(params, expected);
        best->trace_image(params, actual);
        EXPECT_EQ(actual.occlusion, expected.occlusion);
        dark += static_cast<std::size_t>(std::ranges::count(expected.occlusion, 1u));
    }
    EXPECT_GT(dark, 1000u);
}

}  // namespace
}  // namespace mray::test
