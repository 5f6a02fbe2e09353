// The pad of a leaf's box, and the slab test against it: every triangle that a ray hits is in a box
// that the ray meets, wherever and however large the triangle is.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/bvh/box.h"
#include "common/interop/hit_rule.h"
#include "common/interop/slab.h"
#include "tests/support/test_scene.h"

namespace mray {
namespace {

using namespace test;

struct Triangle {
    vec3 vertex[3];

    Box bounds() const {
        Box box;
        for (const vec3& v : vertex) box.extend(v);
        return box;
    }
};

/// Returns triangles of any size, some with an edge in a plane of their box, and some where
/// coordinates are 0.
Triangle random_triangle(Random& random) {
    const double extent = std::ldexp(kSceneExtent, -static_cast<int>(random.below(40)));
    const double far = std::ldexp(kSceneExtent, -static_cast<int>(random.below(40))) / 2;
    const vec3 place = random.below(3) == 0 ? vec3(0, 0, 0) : random.point(far);
    Triangle t;
    for (vec3& v : t.vertex) v = snap_point(place + random.point(extent / 2));
    const std::uint32_t axis = random.below(3);
    if (random.below(2) == 0) t.vertex[0][axis] = 0;
    if (random.below(2) == 0) t.vertex[2][axis] = t.vertex[0][axis];
    if (random.below(4) == 0)
        t.vertex[1] = snap_point(t.vertex[2] + random.point(extent * 0x1p-16));
    return t;
}

/// At a vertex, an edge or a face, from near or far, some along an axis.
Ray random_ray(Random& random, const Triangle& t) {
    const double u = random.below(4) != 0 ? 0 : random.real(0, 1);
    const double v = random.below(4) == 0 ? 0 : random.real(0, 1 - u);
    const vec3 target = t.vertex[0] + (t.vertex[1] - t.vertex[0]) * static_cast<float>(u) +
                        (t.vertex[2] - t.vertex[0]) * static_cast<float>(v);
    const Box bounds = t.bounds();
    const double extent = largest_extent(bounds.lower, bounds.upper);
    const double reach = random.below(3) == 0 ? 2 * kSceneExtent : extent;
    vec3 way = random.point(std::ldexp(reach, 1 - static_cast<int>(random.below(10))));
    way[random.below(3)] *= static_cast<float>(random.below(2));
    const vec3 dir = canonical_direction(way);
    // Sideways, by about as much as the rule displaces vertices.
    const vec3 aside = random.point(extent * 0x1p-24);
    return {snap_point(target - way + aside), 0, dir, kInfiniteT};
}

/// The slab test without pads, dilation and room for rounding.
bool meets_plainly(const Box& box, const Ray& ray) {
    float enter = 0, leave = kInfiniteT;
    for (int axis = 0; axis < 3; ++axis) {
        const float rdir = slab_reciprocal(ray.dir[axis]);
        const float from = (box.lower[axis] - ray.org[axis]) * rdir;
        const float to = (box.upper[axis] - ray.org[axis]) * rdir;
        enter = std::max(enter, std::min(from, to));
        leave = std::min(leave, std::max(from, to));
    }
    return enter <= leave;
}

TEST(PaddedBox, IsMetByEveryRayThatHitsItsTriangle) {
    Random random(1);
    std::size_t hits = 0, missed = 0;
    for (int i = 0; i < 1000000; ++i) {
        const Triangle t = random_triangle(random);
        const Ray ray = random_ray(random, t);
        if (ray.dir == vec3(0, 0, 0)) continue;
        TriangleHit hit;
        const ShearedRay sheared = shear_ray(ray.org, ray.dir);
        if (!intersect_triangle(sheared, 0, kInfiniteT, t.vertex[0], t.vertex[1], t.vertex[2], hit))
            continue;
        ++hits;
        missed += !meets_plainly(t.bounds(), ray);
        const Box box = padded(t.bounds());
        float t_least;
        ASSERT_TRUE(hits_box(slab_ray(ray.org, ray.dir), box.lower, box.upper, t_least)) << i;
        ASSERT_LE(t_least, last_depth(hit.t)) << i;
    }
    EXPECT_GT(hits, 50000u);
    // Else the test would pass without pads and dilation.
    EXPECT_GT(missed, 1000u);
}

TEST(PaddedBox, OfALargerBoxIsLarger) {
    Random random(3);
    for (int i = 0; i < 100000; ++i) {
        const Box part = random_triangle(random).bounds();
        Box whole = part;
        whole.extend(part.upper +
                     random.point(std::ldexp(kSceneExtent, -static_cast<int>(random.below(50)))));
        Box both = padded(whole);
        both.extend(padded(part));
        ASSERT_EQ(both, padded(whole));
    }
    EXPECT_EQ(padded(Box()), Box());
}

}  // namespace
}  // namespace mray
