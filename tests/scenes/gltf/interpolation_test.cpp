#include "scenes/gltf/transforms.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "tests/scenes/gltf/motion_reference.h"

namespace mray::gltf {
namespace {

using namespace test;

glm::dvec4 in_double(const Quaternion& q) {
    return {static_cast<double>(q[0]), static_cast<double>(q[1]), static_cast<double>(q[2]),
            static_cast<double>(q[3])};
}
Quaternion exact(const glm::dvec4& q) { return {q.x, q.y, q.z, q.w}; }

Real distance(const glm::dvec4& a, const Quaternion& b) {
    Real largest = 0;
    for (int k = 0; k < 4; ++k)
        largest =
            std::max(largest, std::fabs(static_cast<Real>(a[k]) - b[static_cast<std::size_t>(k)]));
    return largest;
}

TEST(Slerp, IsThatOfSines) {
    std::mt19937_64 random(1);
    std::normal_distribution<long double> component;
    std::uniform_real_distribution<double> share(0, 1);
    Real worst = 0;
    for (int i = 0; i < 200000; ++i) {
        const Quaternion a =
            unit({component(random), component(random), component(random), component(random)});
        Quaternion b =
            unit({component(random), component(random), component(random), component(random)});
        // A part of the pairs is close together, or almost a half turn apart.
        const Real closeness = std::pow(Real{10}, -static_cast<Real>(i % 17));
        if (i % 2 == 0) {
            for (std::size_t k = 0; k < 4; ++k) b[k] = a[k] + closeness * b[k];
            b = unit(b);
        }
        const glm::dvec4 from = unit_quaternion(in_double(a));
        const glm::dvec4 to = unit_quaternion(in_double(b));
        const double u = i % 5 == 0 ? 0.5 : share(random);
        const Quaternion expected = unit(exact_slerp(unit(exact(from)), unit(exact(to)), u));
        worst = std::max(worst, distance(slerp(from, to, u), expected));
    }
    EXPECT_LT(worst, 1e-15L);
}

TEST(Slerp, KeepsItsEndsAndTakesTheShorterArc) {
    const glm::dvec4 a = unit_quaternion({1, 2, 3, 4});
    const glm::dvec4 b = unit_quaternion({4, -3, 2, 1});
    EXPECT_EQ(slerp(a, b, 0), a);
    EXPECT_EQ(slerp(a, b, 1), b);
    // The same rotation, written with the other sign.
    const glm::dvec4 near = slerp(a, -a, 0.5);
    EXPECT_LT(distance(near, exact(a)), 1e-15L);
}

TEST(Slerp, HalfwayIsSymmetric) {
    const glm::dvec4 a = unit_quaternion({0, 0, 0, 1});
    const glm::dvec4 b = unit_quaternion({0, 0, 1, 0});
    const glm::dvec4 middle = slerp(a, b, 0.5);
    EXPECT_EQ(middle.z, middle.w);
}

TEST(UnitQuaternion, OfNoDirectionIsTheIdentity) {
    EXPECT_EQ(unit_quaternion({0, 0, 0, 0}), glm::dvec4(0, 0, 0, 1));
    const double nan = std::nan("");
    EXPECT_EQ(unit_quaternion({nan, 0, 0, 1}), glm::dvec4(0, 0, 0, 1));
}

}  // namespace
}  // namespace mray::gltf
