// t, u and v of hits against rational numbers.
#include <gmpxx.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <optional>

#include "common/interop/hit_rule.h"
#include "tests/support/random.h"

namespace mray {
namespace {

using test::Random;
using Rational = mpq_class;
using Vector = std::array<Rational, 3>;

Vector difference(vec3 a, vec3 b) {
    return {Rational(a.x) - Rational(b.x), Rational(a.y) - Rational(b.y),
            Rational(a.z) - Rational(b.z)};
}
Vector cross(const Vector& a, const Vector& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
Rational dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

struct Case {
    vec3 org, dir, a, b, c;
};

/// Where the ray goes through the triangle exactly, if it does.
struct ExactHit {
    Rational t, u, v;
};
std::optional<ExactHit> exact_hit_of(const Case& own) {
    const Vector e1 = difference(own.b, own.a), e2 = difference(own.c, own.a);
    const Vector way = difference(own.a, own.org), dir = difference(own.dir, {0, 0, 0});
    const Rational slant = dot(cross(e1, e2), dir);
    if (slant == 0) return {};
    const Vector across = cross(way, dir);
    const ExactHit hit{dot(cross(e1, e2), way) / slant, dot(across, e2) / slant,
                       -dot(across, e1) / slant};
    if (hit.u < 0 || hit.v < 0 || hit.u + hit.v > 1) return {};
    return hit;
}

/// By how many of a unit a float is off.
double off_by(float x, const Rational& exact, double unit) {
    return Rational(abs(Rational(x) - exact) / Rational(unit)).get_d();
}
double ulp_of(float x) { return std::nextafter(x, 2 * x) - static_cast<double>(x); }
constexpr double kUlpOfOne = 0x1p-23;

TriangleHit mean_hit(const Case& own, const ShearedRay& s) {
    const vec3 a = project_fast(s, own.a), b = project_fast(s, own.b), c = project_fast(s, own.c);
    TriangleHit hit;
    weighted_hit(s, fast_edges(a, b, c), a.z, b.z, c.z, hit);
    return hit;
}

/// A triangle as large as scene space, turned by any angle, seen from its extent / `ratio` above
/// it, at 1 to 90 degrees.
Case plane_case(Random& random, double ratio) {
    const double turn = random.real(0, 7), tilt = random.real(0, 7), az = random.real(0, 7);
    const glm::dvec3 n(std::cos(tilt) * std::cos(turn), std::sin(tilt),
                       std::cos(tilt) * std::sin(turn));
    const glm::dvec3 x(-std::sin(turn), 0, std::cos(turn));
    const glm::dvec3 y(n.y * x.z, n.z * x.x - n.x * x.z, -n.y * x.x);
    const double extent = random.real(0.25, 0.5) * kSceneExtent;
    const auto corner = [&](int i) {
        const double angle = 2.1 * i + random.real(0, 1), r = extent * random.real(0.5, 1);
        return snap_point(vec3(r * std::cos(angle) * x + r * std::sin(angle) * y));
    };
    const double down = random.real(0.02, 1.57);
    return {snap_point(vec3(extent / ratio * n + random.real(-0.1, 0.1) * extent * x)),
            canonical_direction(
                vec3(std::cos(down) * (std::cos(az) * x + std::sin(az) * y) - std::sin(down) * n)),
            corner(0), corner(1), corner(2)};
}

TEST(RefinedHits, AreWithinTwoUlpOnPlanesOfAnySize) {
    Random random(94);
    for (const double ratio : {10.0, 1e3, 1e5, 1e6}) {
        int hits = 0, hits_of_mean = 0;
        double t_error = 0, weight_error = 0;
        for (int i = 0; i < 4000; ++i) {
            const Case own = plane_case(random, ratio);
            const ShearedRay s = shear_ray(own.org, own.dir);
            TriangleHit hit;
            const bool is_hit = intersect_triangle(s, 0, kInfiniteT, own.a, own.b, own.c, hit);
            const auto exact = exact_hit_of(own);
            if (!is_hit || !exact) continue;
            ++hits;
            t_error = std::max(t_error, off_by(hit.t, exact->t, ulp_of(hit.t)));
            weight_error = std::max({weight_error, off_by(hit.u, exact->u, kUlpOfOne),
                                     off_by(hit.v, exact->v, kUlpOfOne)});
            const float mean = mean_hit(own, s).t;
            hits_of_mean += off_by(mean, exact->t, ulp_of(mean)) <= 2;
        }
        EXPECT_GT(hits, 1000) << ratio;
        EXPECT_LE(t_error, 2) << ratio;
        EXPECT_LE(weight_error, 2) << ratio;
        // The mean of the vertices' depths alone would not do.
        EXPECT_LT(hits_of_mean, hits) << ratio;
    }
}

TEST(Hits, AreWithinTheirErrorOfTheExactOnes) {
    Random random(95);
    int rough = 0, smooth = 0;
    for (int i = 0; i < 40000; ++i) {
        const double size = std::ldexp(kSceneExtent, -static_cast<int>(random.below(30)));
        const double thin = std::ldexp(size, -static_cast<int>(random.below(20)));
        Case own;
        own.a = snap_point(random.point(kSceneExtent - size));
        own.b = snap_point(own.a + random.point(size));
        own.c = snap_point(own.a + (own.b - own.a) * 0.3f + random.point(thin));
        const auto u = static_cast<float>(random.real(0, 1));
        const auto v = static_cast<float>(random.real(0, 1)) * (1 - u);
        const vec3 target = own.a + (own.b - own.a) * u + (own.c - own.a) * v;
        own.org = snap_point(random.below(2) == 0 ? random.point(kSceneExtent)
                                                  : target + random.point(size));
        own.dir = canonical_direction(target - own.org);
        const ShearedRay s = shear_ray(own.org, own.dir);
        TriangleHit hit;
        if (!intersect_triangle(s, 0, kInfiniteT, own.a, own.b, own.c, hit)) continue;
        const auto exact = exact_hit_of(own);
        if (!exact) continue;
        if (is_rough(hit)) {
            ++rough;
            EXPECT_LE(off_by(hit.t, exact->t, ulp_of(hit.t)), 2);
        } else {
            ++smooth;
            EXPECT_LE(off_by(hit.t, exact->t, hit.error), 1);
        }
    }
    EXPECT_GT(rough, 1000);
    EXPECT_GT(smooth, 1000);
}

}  // namespace
}  // namespace mray
