#include "common/scene/exact_crossing.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "common/interop/tie_break_rule.h"
#include "tests/support/test_scene.h"

namespace mray::test {
namespace {

/// All hits of a ray by the hit rule, in the order of (t, prim_id).
std::vector<Hit> each_hit(const TestScene& scene, const Ray& ray) {
    const ShearedRay sheared = shear_ray(ray.org, ray.dir);
    std::vector<Hit> hits;
    for (std::uint32_t i = 0; i < scene.triangle_count(); ++i) {
        const uvec3 t = scene.topology().triangles[i];
        TriangleHit hit;
        if (intersect_triangle(sheared, ray.tnear, ray.tfar, scene.positions()[t.x],
                               scene.positions()[t.y], scene.positions()[t.z], hit))
            hits.push_back(make_hit(hit, i));
    }
    std::ranges::sort(
        hits, [](const Hit& a, const Hit& b) { return is_closer(a.t, a.prim_id, b.t, b.prim_id); });
    return hits;
}

std::vector<std::uint32_t> kept(const TestScene& scene,
                                const std::vector<std::uint32_t>& first_prims, vec3 org, vec3 dir) {
    const Ray ray = scene_ray(scene, org, dir);
    std::vector<Hit> hits = each_hit(scene, ray);
    keep_one_of_each_crossing(scene.topology(), scene.positions(), first_prims, ray, hits);
    std::vector<std::uint32_t> prims;
    for (const Hit& hit : hits) prims.push_back(hit.prim_id);
    return prims;
}

using Prims = std::vector<std::uint32_t>;

TEST(MayTouchBorder, IsTrueWhereverAnEdgeFunctionIsZero) {
    std::size_t touching = 0;
    for (const NamedScene& named : adversarial_scenes()) {
        const TestScene& scene = named.scene;
        for (const Ray& ray : mixed_rays(scene, 150, 11)) {
            const ShearedRay sheared = shear_ray(ray.org, ray.dir);
            for (const Hit& hit : each_hit(scene, ray)) {
                const uvec3 t = scene.topology().triangles[hit.prim_id];
                const Edges e = exact_edges(project(sheared, scene.positions()[t.x]),
                                            project(sheared, scene.positions()[t.y]),
                                            project(sheared, scene.positions()[t.z]));
                if (e.u != 0 && e.v != 0 && e.w != 0) continue;
                ++touching;
                EXPECT_TRUE(may_touch_border({hit.t, hit.u, hit.v})) << named.name;
            }
        }
    }
    EXPECT_GT(touching, 1000u);
}

TEST(BorderCrossings, AnEdgeAndAVertexCountOnceInAMesh) {
    // A pyramid without a base, and a triangle below it.
    const TestScene scene({{-1, -1, 0},
                           {1, -1, 0},
                           {1, 1, 0},
                           {-1, 1, 0},
                           {0, 0, 1},
                           {-2, -2, -1},
                           {2, -2, -1},
                           {0, 3, -1}},
                          {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}, {5, 6, 7}});
    const vec3 down = {0, 0, -1};
    EXPECT_EQ(kept(scene, {0}, {0, 0, 5}, down), (Prims{0, 4}));
    EXPECT_EQ(kept(scene, {0}, {0.5f, 0.5f, 5}, down), (Prims{1, 4}));
    EXPECT_EQ(kept(scene, {0}, {0.25f, -0.5f, 5}, down), (Prims{0, 4}));
    // On the border of the pyramid, and at one of its corners.
    EXPECT_EQ(kept(scene, {0}, {0, 1, 5}, down), (Prims{2, 4}));
    EXPECT_EQ(kept(scene, {0}, {-1, 1, 5}, down), Prims{2});
    // Each mesh has crossings of its own.
    EXPECT_EQ(kept(scene, {0, 2, 4}, {0, 0, 5}, down), (Prims{0, 2, 4}));
}

TEST(BorderCrossings, PlacesDecideAndNotIndices) {
    const TestScene scene({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 0, 0}, {1, 1, 0}, {-0.0f, 1, 0}},
                          {{0, 1, 2}, {3, 4, 5}});
    EXPECT_EQ(kept(scene, {0}, {0.5f, 0.5f, 1}, {0, 0, -1}), Prims{0});
}

}  // namespace
}  // namespace mray::test
