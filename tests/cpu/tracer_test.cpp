#include <gtest/gtest.h>
#ifdef __SSE__
#include <xmmintrin.h>
#endif

#include <algorithm>
#include <cfenv>
#include <cmath>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/bvh/builder/bvh_builder.h"
#include "common/interop/camera.h"
#include "common/interop/shading.h"
#include "common/scene/camera_setup.h"
#include "common/simd/simd_target.h"
#include "cpu/cpu_backend.h"
#include "cpu/image/pixel_shader.h"
#include "cpu/reference/scalar_tracer.h"
#include "cpu/single_ray/single_ray_tracer.h"
#include "tests/support/backend_results.h"
#include "tests/support/late_boxes.h"
#include "tests/support/same_bits.h"
#include "tests/support/test_scene.h"

namespace mray {
namespace {

using namespace test;

TEST(Ties, GoToTheSmallerPrimId) {
    // The same triangle eight times, in both windings, among others farther away.
    std::vector<vec3> positions = {{-1, -1, 0},  {1, -1, 0},  {0, 1, 0},
                                   {-1, -1, -1}, {1, -1, -1}, {0, 1, -1}};
    std::vector<uvec3> triangles = {{3, 4, 5}};
    for (int i = 0; i < 4; ++i) triangles.insert(triangles.end(), {{0, 1, 2}, {2, 1, 0}});
    const TestScene scene(positions, triangles);
    const Bvh bvh = build_bvh(scene.topology(), scene.positions());
    const Hit hit = cpu::ScalarTracer(bvh).intersect(scene_ray(scene, {0.1f, 0, 5}, {0, 0, -1}));
    EXPECT_EQ(hit.prim_id, 1u);
}

TEST(UnitTriangle, IsHitAtKnownTAndBarycentrics) {
    const TestScene scene({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}});
    const cpu::BruteTracer brute(scene.topology(), scene.positions());
    const WorldRay world{{0.25, 0.5, 2}, {0, 0, -4}, 0, INFINITY};
    const SceneRay ray = to_scene(scene.space(), world);
    const Hit hit = brute.intersect(ray.ray);
    ASSERT_EQ(hit.prim_id, 0u);
    EXPECT_EQ(hit.u, 0.25f);
    EXPECT_EQ(hit.v, 0.5f);
    EXPECT_EQ(std::ldexp(hit.t, ray.t_exponent), 0.5f);
    const auto hits_between = [&](double tnear, double tfar) {
        return brute.occluded(scene_ray(scene, {0.25f, 0.5f, 2}, {0, 0, -4}, tnear, tfar));
    };
    EXPECT_TRUE(hits_between(0.5, 0.5));
    EXPECT_FALSE(hits_between(0, 0.49999));
    EXPECT_FALSE(hits_between(0.50001, 9));
}

TEST(OriginInThePlaneOfATriangle, HitsItNeitherFromItsInsideNorFromBeside) {
    const TestScene scene({{-0.7f, -0.3f, 0}, {0.9f, -0.4f, 0}, {0.1f, 0.8f, 0}}, {{0, 1, 2}});
    const cpu::BruteTracer brute(scene.topology(), scene.positions());
    Random random(45);
    for (int i = 0; i < 20000; ++i) {
        vec3 org = random.point();
        org.z = 0;
        EXPECT_FALSE(brute.occluded(scene_ray(scene, org, random.point())));
    }
}

#ifdef __SSE__
void clear_float_flags() { _mm_setcsr(_mm_getcsr() & ~0x3Fu); }
/// Returns whether any flag but inexact is up: x86 also has one for denormal operands.
bool raised_more_than_inexact() { return (_mm_getcsr() & 0x1Fu) != 0; }
#else
void clear_float_flags() { std::feclearexcept(FE_ALL_EXCEPT); }
bool raised_more_than_inexact() { return std::fetestexcept(FE_ALL_EXCEPT & ~FE_INEXACT) != 0; }
#endif

TEST(Arithmetic, OfRaysAndImagesRaisesNothingButInexact) {
    const auto scalar = cpu::make_scalar_backend({.threads = 1});
    for (const NamedScene& named : adversarial_scenes()) {
        const TestScene& scene = named.scene;
        scalar->set_scene(scene.topology(), scene.pose(),
                          build_bvh(scene.topology(), scene.positions()));
        const std::vector<Ray> rays = mixed_rays(scene, 1000, 61);
        std::vector<Hit> hits(rays.size());
        ImageParams params = make_image_params({.width = 16, .height = 16},
                                               bounds_of(scene.world_positions()), scene.space());
        Frame frame;
        clear_float_flags();
        scalar->trace({rays, hits});
        for (const std::uint32_t kind : {kRaysPrimary, kRaysShadow, kRaysAo}) {
            params.rays = kind;
            scalar->trace_image(params, frame);
        }
        EXPECT_FALSE(raised_more_than_inexact()) << named.name;
    }
}

/// The image of a scene by brute force and the shared text of surfaces and colours, pixel by pixel.
Frame reference_image(const TestScene& scene, const ImageParams& params) {
    const cpu::BruteTracer tracer(scene.topology(), scene.positions());
    const cpu::ShadedMesh mesh{&scene.topology(), scene.positions()};
    Frame frame;
    frame.width = params.width;
    frame.height = params.height;
    for (std::uint32_t y = 0; y < params.height; ++y) {
        for (std::uint32_t x = 0; x < params.width; ++x) {
            const Ray ray = camera_ray(params.camera, x, y);
            const Hit hit = tracer.intersect(ray);
            frame.hits.push_back(hit);
            std::uint32_t& occluded = frame.occlusion.emplace_back(0);
            if (hit.prim_id == kNoPrim) {
                frame.pixels.push_back(background(y, params.height));
                continue;
            }
            const Surface surface = mesh.surface(ray, hit);
            if (params.rays == kRaysShadow) {
                occluded = !faces_light(surface, params.light) ||
                           tracer.occluded(shadow_ray(surface, params.light));
            }
            for (std::uint32_t i = 0; params.rays == kRaysAo && i < params.ao_count; ++i)
                occluded += tracer.occluded(ao_ray(surface, x, y, i, params.ao_tfar));
            frame.pixels.push_back(
                shade(params, ray, surface, scene.topology().albedo[hit.prim_id], occluded));
        }
    }
    return frame;
}

void expect_same_images(const NamedScene& named, ViewSpec view) {
    const TestScene& scene = named.scene;
    const Bvh bvh = build_bvh(scene.topology(), scene.positions());
    std::vector<std::pair<std::string, std::unique_ptr<Backend>>> backends;
    backends.emplace_back("brute force", cpu::make_brute_backend());
    for (const int threads : {1, 2, 4})
        backends.emplace_back(std::to_string(threads) + " threads",
                              cpu::make_scalar_backend({threads}));
    for (const SimdTarget& target : supported_simd_targets())
        backends.emplace_back(target.name,
                              cpu::make_cpu_backend({.threads = 2, .simd = target.name}));
    for (const auto& [how, backend] : backends)
        backend->set_scene(scene.topology(), scene.pose(), bvh);
    for (const std::uint32_t rays : {kRaysPrimary, kRaysShadow, kRaysAo}) {
        view.rays = rays;
        const ImageParams params =
            make_image_params(view, bounds_of(scene.world_positions()), scene.space());
        const Frame frame = reference_image(scene, params);
        const ImageHashes expected = {hits_hash(frame), image_hash(frame)};
        for (const auto& [how, backend] : backends)
            EXPECT_EQ(image_hashes(*backend, params), expected)
                << named.name << ", " << how << ", rays " << rays;
    }
}

TEST(Images, AreTheSameForBruteForceTreesThreadsAndSimdTargets) {
    // Sizes that are no multiple of a tile or of a block, and more than a strip.
    const struct { std::uint32_t width, height; } sizes[] = {{61, 47}, {3, 9}, {130, 6}};
    ViewSpec view;
    for (const NamedScene& named : adversarial_scenes()) {
        for (const auto& [width, height] : sizes) {
            view.width = width;
            view.height = height;
            view.ao_count = 1 + width % 4;
            expect_same_images(named, view);
        }
    }
    view.width = 37;
    view.height = 21;
    view.ao_count = 256;
    view.eye = Point{0.1, 0.05, -0.02};
    view.target = Point{1.0, 0.4, 0.3};
    view.fov = 120;
    expect_same_images({"star from inside", star(3, 7)}, view);
}

TEST(ShadowImage, OfAFloorUnderAPlateIsDarkWhereTheProjectionSays) {
    // A floor at y = 0 and a small plate at y = 1, the light straight above the plate's centre at y
    // = 3: the shadow on the floor is the plate enlarged by 3/2.
    const TestScene scene({{-4, 0, -4},
                           {4, 0, -4},
                           {4, 0, 4},
                           {-4, 0, 4},
                           {-1, 1, -1},
                           {1, 1, -1},
                           {1, 1, 1},
                           {-1, 1, 1}},
                          {{0, 1, 2}, {0, 2, 3}, {4, 5, 6}, {4, 6, 7}});
    const auto backend = cpu::make_scalar_backend();
    backend->set_scene(scene.topology(), scene.pose(),
                       build_bvh(scene.topology(), scene.positions()));
    ViewSpec view;
    view.eye = Point{0, 0.5, 0};  // between floor and plate, looking down
    view.target = Point{0, 0, 0};
    view.up = {0, 0, 1};
    view.light = Point{0, 3, 0};
    view.fov = 150;
    view.width = view.height = 64;
    view.rays = kRaysShadow;
    const ImageParams params =
        make_image_params(view, bounds_of(scene.world_positions()), scene.space());
    Frame frame;
    backend->trace_image(params, frame);
    std::size_t dark = 0;
    for (std::uint32_t y = 0; y < 64; ++y) {
        for (std::uint32_t x = 0; x < 64; ++x) {
            const std::size_t pixel = std::size_t{y} * 64 + x;
            if (frame.hits[pixel].prim_id == kNoPrim) continue;
            const Ray ray = camera_ray(params.camera, x, y);
            const vec3 p = scene.space().to_world(ray.org + ray.dir * frame.hits[pixel].t);
            const double r = std::max(std::abs(p.x), std::abs(p.z));
            if (std::abs(r - 1.5) < 1e-3) continue;
            EXPECT_EQ(frame.occlusion[pixel], r < 1.5 ? 1u : 0u) << p.x << " " << p.z;
            dark += r < 1.5;
        }
    }
    EXPECT_GT(dark, 100u);
}

/// The closest hits, each of which must be the first triangle's.
std::vector<Hit> true_hits(const LateBoxes& scene, std::span<const Ray> rays) {
    const cpu::BruteTracer brute(scene.topology, scene.positions);
    std::vector<Hit> hits;
    for (const Ray& ray : rays) {
        hits.push_back(brute.intersect(ray));
        EXPECT_EQ(hits.back().prim_id, 0u);
    }
    return hits;
}

TEST(LateBoxes, AreEnteredByTheScalarTracerAndSingleRaysOnEveryTarget) {
    const LateBoxes scene = late_boxes(63);
    const LateBoxes all_late = late_boxes(kNoPrim);
    for (const std::size_t count : {1, 3, 8, 64, 500}) {
        const std::vector<Ray> rays = rays_at_late_boxes(count);
        const std::vector<Hit> expected = true_hits(scene, rays);
        // The same rays, which end at their hits.
        std::vector<Ray> ending = rays;
        for (std::size_t i = 0; i < count; ++i) {
            ending[i].tfar = expected[i].t;
            EXPECT_TRUE(same_bits(cpu::ScalarTracer(scene.bvh).intersect(rays[i]), expected[i]));
            const cpu::ScalarTracer late_tracer(all_late.bvh);
            EXPECT_TRUE(same_bits(late_tracer.intersect(ending[i]), expected[i]));
            EXPECT_TRUE(late_tracer.occluded(ending[i]));
        }
        for (const SimdTarget& target : supported_simd_targets()) {
            SCOPED_TRACE(target.name);
            std::vector<Hit> hits(count);
            cpu::SingleRayTracer(scene.bvh, target).intersect(rays, hits);
            EXPECT_TRUE(same_bytes(hits, expected)) << count;
            const cpu::SingleRayTracer late_tracer(all_late.bvh, target);
            late_tracer.intersect(ending, hits);
            EXPECT_TRUE(same_bytes(hits, expected)) << count;
            std::vector<std::uint8_t> occluded(count, 0);
            late_tracer.occluded(ending, occluded);
            EXPECT_EQ(std::ranges::count(occluded, 1), std::ssize(occluded)) << count;
        }
    }
}

}  // namespace
}  // namespace mray
