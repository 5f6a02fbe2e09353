// The rules of closest points and of windings.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include "common/bvh/box.h"
#include "common/interop/closest_rule.h"
#include "common/interop/winding_rule.h"
#include "common/scene/exact_crossing.h"
#include "tests/support/same_bits.h"
#include "tests/support/test_scene.h"

namespace mray::test {
namespace {

using glm::dvec3;

double exact_distance_to_edge(dvec3 a, dvec3 b) {
    const dvec3 e = b - a;
    const double length2 = glm::dot(e, e);
    const double s = length2 > 0 ? std::clamp(-glm::dot(a, e) / length2, 0.0, 1.0) : 0;
    return glm::length(a + s * e);
}

/// The distance of a triangle, in doubles: exact for the floats that are compared with it.
double exact_distance(vec3 p, vec3 pa, vec3 pb, vec3 pc) {
    const dvec3 a = dvec3(pa) - dvec3(p);
    const dvec3 b = dvec3(pb) - dvec3(p);
    const dvec3 c = dvec3(pc) - dvec3(p);
    double least = std::min(
        {exact_distance_to_edge(a, b), exact_distance_to_edge(b, c), exact_distance_to_edge(c, a)});
    const dvec3 n = glm::cross(b - a, c - a);
    const double size = glm::length(n);
    if (size > 0 && glm::dot(n, glm::cross(b, c)) > 0 && glm::dot(n, glm::cross(c, a)) > 0 &&
        glm::dot(n, glm::cross(a, b)) > 0)
        least = std::min(least, std::abs(glm::dot(n, a)) / size);
    return least;
}

/// A triangle of some shape and size, and a point somewhere around it.
struct Case {
    vec3 p, a, b, c;
};

vec3 snapped(dvec3 p) { return snap_point(vec3(p)); }

Case random_case(Random& random) {
    const auto some = [&](double size) {
        return dvec3(random.real(-size, size), random.real(-size, size), random.real(-size, size));
    };
    const dvec3 centre = some(std::exp2(random.real(-10, 19)));
    const double size = std::exp2(random.real(-10, 18));
    dvec3 a = centre + some(size);
    dvec3 b = centre + some(size);
    dvec3 c = centre + some(size);
    // Needles and caps, down to no area.
    const double thin = std::exp2(random.real(-40, 0));
    const double at = random.real(-0.2, 1.2);
    if (random.below(2) == 0) c = a + at * (b - a) + thin * (c - a);
    const double u = random.real(-0.5, 1.5);
    const double v = random.real(-0.5, 1.5);
    dvec3 p = a + u * (b - a) + v * (c - a) + some(size * std::exp2(random.real(-30, 4)));
    if (random.below(8) == 0) p = some(0x1p+21);
    return {snapped(p), snapped(a), snapped(b), snapped(c)};
}

TEST(ClosestRule, IsWithinItsBoundOfTheExactDistance) {
    Random random(3);
    double largest = 0;
    for (int i = 0; i < 2000000; ++i) {
        const Case one = random_case(random);
        const double found = std::sqrt(double{triangle_distance2(one.p, one.a, one.b, one.c)});
        const double exact = exact_distance(one.p, one.a, one.b, one.c);
        const double size = std::max({glm::length(dvec3(one.a) - dvec3(one.p)),
                                      glm::length(dvec3(one.b) - dvec3(one.p)),
                                      glm::length(dvec3(one.c) - dvec3(one.p))});
        if (size > 0) largest = std::max(largest, std::abs(found - exact) / size);
    }
    EXPECT_LT(largest, 0x1p-21);
    RecordProperty("largest_error_in_2^-24", std::to_string(largest * 0x1p+24));
}

TEST(ClosestRule, IsNotNearerThanAnyBoxAroundTheTriangle) {
    Random random(4);
    std::size_t nearer = 0;
    for (int i = 0; i < 500000; ++i) {
        const Case one = random_case(random);
        Box box;
        for (const vec3& corner : {one.a, one.b, one.c}) box.extend(corner);
        const float least = box_distance2(one.p, box.lower, box.upper);
        nearer += triangle_distance2(one.p, one.a, one.b, one.c) < least;
        const Box larger = padded(box);
        nearer += least < box_distance2(one.p, larger.lower, larger.upper);
    }
    EXPECT_EQ(nearer, 0u);
}

TEST(ClosestRule, GivesVerticesAndEdgesTheSameBitsInAllTriangles) {
    Random random(5);
    std::size_t different = 0;
    std::size_t ends = 0;
    for (int i = 0; i < 200000; ++i) {
        const Case one = random_case(random);
        const vec3 a = one.a - one.p;
        const vec3 b = one.b - one.p;
        const vec3 near = closest_on_edge(a, b);
        different += near != closest_on_edge(b, a);
        const dvec3 along = dvec3(b) - dvec3(a);
        const double at = -glm::dot(dvec3(a), along);
        // Surely beyond an end.
        const double size = 0x1p-20 * (glm::dot(dvec3(a), dvec3(a)) + glm::dot(along, along));
        if (at >= -size && at <= glm::dot(along, along) + size) continue;
        ++ends;
        different += near != (at < 0 ? a : b);
    }
    EXPECT_EQ(different, 0u);
    EXPECT_GT(ends, 50000u);
}

/// A triangle and a point next to it, on its plane, or under one of its edges or corners; in world
/// space, of which scene space rounds the smallest coordinates.
Case random_winding_case(Random& random) {
    const auto some = [&](double size) {
        const double x = random.real(-size, size);
        const double y = random.real(-size, size);
        return vec3(x, y, random.real(-size, size));
    };
    const vec3 centre =
        random.below(2) == 0 ? vec3(0, 0, 0) : some(std::exp2(random.real(-40, 19)));
    const double size = std::exp2(random.real(-40, 19));
    Case one;
    one.a = centre + some(size);
    one.b = centre + some(size);
    one.c = centre + some(size);
    // Steep and thin ones.
    const auto shrink = static_cast<float>(std::exp2(random.real(-30, 0)));
    if (random.below(2) == 0) one.c = one.a + (one.c - one.a) * shrink;
    if (random.below(2) == 0) one.b.x = one.a.x + (one.b.x - one.a.x) * shrink;
    // Near a corner, on an edge, on the face.
    const auto weight = [&] {
        const double most = random.below(2) == 0 ? std::exp2(random.real(-40, 0)) : 1;
        return random.below(3) == 0 ? 0 : random.real(0, most);
    };
    const double u = weight();
    const double v = std::min(weight(), 1 - u);
    for (int axis = 0; axis < 3; ++axis) {
        const double from = one.a[axis];
        one.p[axis] =
            static_cast<float>(from + u * (one.b[axis] - from) + v * (one.c[axis] - from));
        for (std::uint32_t ulps = random.below(3); ulps > 0; --ulps)
            one.p[axis] = std::nextafter(one.p[axis], random.below(2) == 0 ? -1e9f : 1e9f);
    }
    if (random.below(3) == 0) one.p.z -= static_cast<float>(random.real(-size, size));
    return one;
}

TEST(WindingRule, IsNeverWrongNextToATriangle) {
    Random random(6);
    std::size_t wrong = 0;
    std::size_t certain = 0;
    for (int i = 0; i < 1500000; ++i) {
        const Case one = random_winding_case(random);
        const FloatCrossing found =
            float_crossing(clipped_point(snap_point(one.p)), snap_point(one.a), snap_point(one.b),
                           snap_point(one.c));
        if (found.is_uncertain) continue;
        const ExactCrossing exact = exact_crossing(one.p, one.a, one.b, one.c);
        ++certain;
        wrong += found.is_up - found.is_down != exact.sign || exact.is_on_triangle;
    }
    EXPECT_EQ(wrong, 0u);
    EXPECT_GT(certain, 300000u);
}

TEST(WindingRule, IsCertainOfNearlyAll) {
    Random random(7);
    std::size_t uncertain = 0;
    std::size_t crossed = 0;
    for (int i = 0; i < 100000; ++i) {
        const vec3 a = random.point();
        const vec3 b = random.point();
        const vec3 c = random.point();
        const FloatCrossing found = float_crossing(random.point(), a, b, c);
        uncertain += found.is_uncertain;
        crossed += found.is_up || found.is_down;
    }
    EXPECT_LT(uncertain, 20u);
    EXPECT_GT(crossed, 3000u);
}

}  // namespace
}  // namespace mray::test
