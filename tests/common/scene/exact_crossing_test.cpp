#include "common/scene/exact_crossing.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "common/interop/tie_break_rule.h"
#include "tests/support/test_scene.h"

namespace mray::test {
namespace {

/// A corner as seen from a point that is moved by (e, e^2, e^3) with e = 2^-5, in units of 2^-15.
struct MovedCorner {
    std::int64_t x, y, z;

    MovedCorner(vec3 p, vec3 corner)
        : x(scaled(corner.x - p.x) - 1024),
          y(scaled(corner.y - p.y) - 32),
          z(scaled(corner.z - p.z) - 1) {}
    static std::int64_t scaled(float x) { return static_cast<std::int64_t>(x) * 32768; }
    /// The edge function seen along z.
    std::int64_t edge(const MovedCorner& to) const { return x * to.y - y * to.x; }
};

/// The crossing of a half-line that goes through no edge, and does not begin on the triangle.
int moved_crossing(vec3 p, vec3 a, vec3 b, vec3 c) {
    const MovedCorner ra(p, a);
    const MovedCorner rb(p, b);
    const MovedCorner rc(p, c);
    const std::int64_t u = rb.edge(rc);
    const std::int64_t v = rc.edge(ra);
    const std::int64_t w = ra.edge(rb);
    const std::int64_t height = u * ra.z + v * rb.z + w * rc.z;
    if (u > 0 && v > 0 && w > 0 && height > 0) return 1;
    return u < 0 && v < 0 && w < 0 && height < 0 ? -1 : 0;
}

TEST(ExactCrossing, IsThatOfAPointThatIsMovedALittle) {
    // Coordinates of -1, 0 and 1: 2^-5 is less than any ratio of their determinants.
    const auto at = [](int i) { return vec3(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1); };
    std::size_t wrong = 0;
    std::size_t crossed = 0;
    for (int a = 0; a < 27; ++a) {
        for (int b = 0; b < 27; ++b) {
            // The order of the corners turns the sign alone.
            for (int c = a; c < 27; ++c) {
                for (int p = 0; p < 27; ++p) {
                    const int expected = moved_crossing(at(p), at(a), at(b), at(c));
                    wrong += exact_crossing(at(p), at(a), at(b), at(c)).sign != expected;
                    crossed += expected != 0;
                }
            }
        }
    }
    EXPECT_EQ(wrong, 0u);
    EXPECT_GT(crossed, 1000u);
}

TEST(ExactCrossing, TakesDenormalsBesideOtherNumbers) {
    // In the middle of an edge from 0 to a point of which one coordinate is a denormal, at last.
    const vec3 a(0, 0, 0);
    const vec3 b(0x1p-125f, 0x1p-126f, 0);
    const vec3 c(0, 1, 0);
    EXPECT_TRUE(exact_crossing({0x1p-126f, 0x1p-127f, 0}, a, b, c).is_on_triangle);
    EXPECT_FALSE(exact_crossing({0x1p-126f, 0x1.fffff8p-128f, 0}, a, b, c).is_on_triangle);
}

TEST(ExactCrossing, TakesCoordinatesOfAllSizes) {
    const float tiny = std::numeric_limits<float>::denorm_min();
    const float huge = std::numeric_limits<float>::max();
    const std::vector<vec3> far = {{-huge, -huge, tiny}, {huge, -huge, tiny}, {0, huge, tiny}};
    const auto at = [&](float z) { return exact_crossing({0, 0, z}, far[0], far[1], far[2]); };
    EXPECT_EQ(at(0).sign, 1);
    EXPECT_EQ(at(2 * tiny).sign, 0);
    EXPECT_TRUE(at(tiny).is_on_triangle);
    EXPECT_FALSE(at(0).is_on_triangle);
    // Planes that a float cannot tell apart.
    const float third = 1.0f / 3;
    const float above = std::nextafter(third, 1.0f);
    EXPECT_EQ(
        exact_crossing({third, third, third}, {0, 0, above}, {1, 0, above}, {0, 1, above}).sign, 1);
    EXPECT_EQ(
        exact_crossing({third, third, above}, {0, 0, third}, {1, 0, third}, {0, 1, third}).sign, 0);
}

TEST(ExactCrossing, FindsPointsOnTrianglesWithoutArea) {
    const vec3 a(0, 0, 0);
    const vec3 b(2, 2, 2);
    EXPECT_TRUE(exact_crossing({1, 1, 1}, a, b, a).is_on_triangle);
    EXPECT_TRUE(exact_crossing({1, 1, 1}, a, {1, 1, 1}, b).is_on_triangle);
    EXPECT_FALSE(exact_crossing({3, 3, 3}, a, b, a).is_on_triangle);
    EXPECT_FALSE(exact_crossing({1, 1, std::nextafter(1.0f, 2.0f)}, a, b, a).is_on_triangle);
    EXPECT_TRUE(exact_crossing(a, a, a, a).is_on_triangle);
    EXPECT_FALSE(exact_crossing(b, a, a, a).is_on_triangle);
    // Upright.
    EXPECT_TRUE(exact_crossing({0, 1, 1}, a, {0, 3, 0}, {0, 0, 3}).is_on_triangle);
    EXPECT_FALSE(exact_crossing({0, 2, 2}, a, {0, 3, 0}, {0, 0, 3}).is_on_triangle);
}

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
                EXPECT_TRUE(may_touch_border(hit.u, hit.v)) << named.name;
            }
        }
    }
    EXPECT_GT(touching, 1000u);
}

TEST(BorderCrossings, AnEdgeAndAVertexCountOnceInAMesh) {
    // A pyramid without a base, and a triangle below it.
    const std::vector<vec3> positions = {{-1, -1, 0}, {1, -1, 0},   {1, 1, 0},   {-1, 1, 0},
                                         {0, 0, 1},   {-2, -2, -1}, {2, -2, -1}, {0, 3, -1}};
    const TestScene scene(positions, {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}, {5, 6, 7}});
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
