#include "common/interop/winding_rule.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/scene/exact_crossing.h"
#include "tests/support/test_scene.h"

namespace mray::test {
namespace {

/// A triangle and a point next to it, on its plane, or under one of its edges or corners; in world
/// space, of which scene space rounds the smallest coordinates.
struct WindingCase {
    vec3 p, a, b, c;
};

WindingCase random_winding_case(Random& random) {
    const auto some = [&](double size) {
        const double x = random.real(-size, size);
        const double y = random.real(-size, size);
        return vec3(x, y, random.real(-size, size));
    };
    const vec3 centre =
        random.below(2) == 0 ? vec3(0, 0, 0) : some(std::exp2(random.real(-40, 19)));
    const double size = std::exp2(random.real(-40, 19));
    WindingCase one;
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

vec3 to_scene(vec3 p) { return snap_point(p); }

TEST(WindingRule, IsNeverWrongNextToATriangle) {
    Random random(6);
    std::size_t wrong = 0;
    std::size_t certain = 0;
    for (int i = 0; i < 1500000; ++i) {
        const WindingCase one = random_winding_case(random);
        const FloatCrossing found = float_crossing(clipped_point(to_scene(one.p)), to_scene(one.a),
                                                   to_scene(one.b), to_scene(one.c));
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
