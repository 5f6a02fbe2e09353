#include "common/bvh/exact_closest.h"

#include <gmpxx.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/bvh/builder/bvh_builder.h"
#include "tests/support/test_scene.h"

namespace mray::test {
namespace {

struct Exact {
    mpq_class x, y, z;

    explicit Exact(const dvec3& v) : x(v.x), y(v.y), z(v.z) {}
    Exact(mpq_class x_, mpq_class y_, mpq_class z_)
        : x(std::move(x_)), y(std::move(y_)), z(std::move(z_)) {}
};

Exact operator-(const Exact& a, const Exact& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
mpq_class dot(const Exact& a, const Exact& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

/// A place a + v (b - a) + w (c - a).
struct Place {
    mpq_class distance2, v, w;
};

Place place_of(const Exact& p, const Exact& a, const Exact& b, const Exact& c, mpq_class v,
               mpq_class w) {
    const Exact ab = b - a;
    const Exact ac = c - a;
    const Exact q{a.x + v * ab.x + w * ac.x, a.y + v * ab.y + w * ac.y, a.z + v * ab.z + w * ac.z};
    return {dot(p - q, p - q), std::move(v), std::move(w)};
}

/// The closest place, by the regions of C. Ericson (Real-Time Collision Detection, 2005, 5.1.5).
Place closest_place(const dvec3& point, const Corners& corners) {
    const Exact p(point);
    const Exact a{dvec3(corners[0])}, b{dvec3(corners[1])}, c{dvec3(corners[2])};
    const Exact ab = b - a, ac = c - a;
    const mpq_class d1 = dot(ab, p - a), d2 = dot(ac, p - a);
    if (d1 <= 0 && d2 <= 0) return place_of(p, a, b, c, 0, 0);
    const mpq_class d3 = dot(ab, p - b), d4 = dot(ac, p - b);
    if (d3 >= 0 && d4 <= d3) return place_of(p, a, b, c, 1, 0);
    const mpq_class d5 = dot(ab, p - c), d6 = dot(ac, p - c);
    if (d6 >= 0 && d5 <= d6) return place_of(p, a, b, c, 0, 1);
    const mpq_class vc = d1 * d4 - d3 * d2;
    if (vc <= 0 && d1 >= 0 && d3 <= 0) return place_of(p, a, b, c, d1 / (d1 - d3), 0);
    const mpq_class vb = d5 * d2 - d1 * d6;
    if (vb <= 0 && d2 >= 0 && d6 <= 0) return place_of(p, a, b, c, 0, d2 / (d2 - d6));
    const mpq_class va = d3 * d6 - d5 * d4;
    if (va <= 0 && d4 >= d3 && d5 >= d6) {
        const mpq_class w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return place_of(p, a, b, c, 1 - w, w);
    }
    const mpq_class sum = va + vb + vc;
    return place_of(p, a, b, c, vb / sum, vc / sum);
}

/// A plate, flat or with waves.
TestScene plate(double height) {
    return shapes::height_map(
        5, 5, [height](auto x, auto y) { return height * std::sin(9.0 * x) * std::cos(7.0 * y); });
}

/// Triangles of all shapes, needles among them.
TestScene mixture(Random& random) {
    Shape shape = shapes::soup(random, 60, 0.1);
    for (std::size_t i = 0; i < shape.positions.size(); i += 3) {
        const dvec3 a = shape.positions[i];
        dvec3& c = shape.positions[i + 2];
        const dvec3 along = random.real(-0.2, 1.2) * (shape.positions[i + 1] - a);
        c = a + along + std::exp2(random.real(-30, 0)) * (c - a);
    }
    return shape;
}

TEST(ExactClosest, IsTheLowestOfTheClosestTrianglesFromAnyDistance) {
    Random random(65);
    for (const TestScene& scene : {plate(0), plate(0.25), mixture(random)}) {
        const Bvh bvh = build_bvh(scene.topology(), scene.positions());
        const auto count = static_cast<std::uint32_t>(scene.triangle_count());
        const auto corners_of = [&](std::uint32_t i) {
            const uvec3& t = scene.topology().triangles[i];
            return Corners{scene.positions()[t.x], scene.positions()[t.y], scene.positions()[t.z]};
        };
        std::vector<NumberedTriangle> all;
        for (std::uint32_t k = count; k-- > 0;) all.push_back({k, corners_of(k)});
        double largest = 0;
        int in_doubles = 0;
        for (int i = 0; i < 150; ++i) {
            // From a place on the surface, in some direction, 1e-7 to 1e7 sizes away.
            const Corners from = corners_of(random.below(count));
            const double u = random.real(0, 0.5);
            const dvec3 on = dvec3(from[0]) * (1 - u) + dvec3(from[random.below(3)]) * u;
            dvec3 dir(random.real(-1, 1), random.real(-1, 1), random.real(-1, 1));
            if (i % 3 == 0) dir = {0, 0, 1};
            const double far = std::pow(10, random.real(-7, 7)) * 2 * kSceneExtent;
            const dvec3 p(vec3(on + dir * far));
            std::vector<Place> places;
            for (std::uint32_t k = 0; k < count; ++k)
                places.push_back(closest_place(p, corners_of(k)));
            const auto expected =
                std::ranges::min_element(places, {}, &Place::distance2) - places.begin();
            const std::uint32_t found = exact_closest(bvh, p).prim_id;
            ASSERT_EQ(found, expected) << i;
            ASSERT_EQ(exact_closest(p, all).prim_id, found) << i;
            const Place& place = places[found];
            const ExactPlace own = exact_place(p, corners_of(found));
            ASSERT_EQ(own.weights[0] == 0, place.v + place.w == 1) << i;
            ASSERT_EQ(own.weights[1] == 0, place.v == 0) << i;
            ASSERT_EQ(own.weights[2] == 0, place.w == 0) << i;
            const Corners corners = corners_of(found);
            const double distance = std::sqrt(place.distance2.get_d());
            const double rounded = distance_in_doubles(p, corners, own.weights);
            in_doubles += rounded > 0;
            ASSERT_TRUE(rounded == 0 || std::abs(rounded - distance) <= distance * 0x1p-24) << i;
            ASSERT_LE(std::abs(exact_distance_of(p, corners) - distance), distance * 0x1p-50) << i;
            for (int axis = 0; axis < 3; ++axis) {
                const mpq_class a(double{corners[0][axis]});
                const mpq_class exact = a + place.v * (double{corners[1][axis]} - a) +
                                        place.w * (double{corners[2][axis]} - a);
                largest = std::max(largest, std::abs(own.point[axis] - exact.get_d()));
            }
        }
        EXPECT_LT(largest, kSceneExtent * 0x1p-26);
        EXPECT_GT(in_doubles, 100);
    }
}

}  // namespace
}  // namespace mray::test
