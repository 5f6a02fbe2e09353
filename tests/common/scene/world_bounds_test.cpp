#include "common/scene/scene_space.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "tests/support/test_scene.h"

namespace mray {
namespace {

TEST(WorldBounds, AreThoseOfTheFinitePointsForAnyNumber) {
    test::Random random(3);
    for (const std::size_t count : {0u, 1u, 2u, 1023u, 1024u, 1025u, 3000u, 4096u}) {
        for (const int kind : {0, 1, 2, 3}) {
            std::vector<vec3> points;
            for (std::size_t i = 0; i < count; ++i) {
                vec3 p = random.point(kind == 1 ? 3e38 : 2);
                if (kind == 2) p += vec3(100, -100, 50);
                if (kind == 3 && random.below(700) == 0)
                    p[static_cast<int>(random.below(3))] =
                        random.below(2) == 0 ? std::nanf("")
                                             : -std::numeric_limits<float>::infinity();
                points.push_back(p);
            }
            std::vector<vec3> finite;
            for (const vec3& p : points)
                if (std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z))
                    finite.push_back(p);
            const WorldBounds bounds = bounds_of(points);
            ASSERT_EQ(bounds.empty(), finite.empty());
            for (int axis = 0; axis < 3 && !finite.empty(); ++axis) {
                const auto less = [&](const vec3& a, const vec3& b) { return a[axis] < b[axis]; };
                const auto [low, high] = std::minmax_element(finite.begin(), finite.end(), less);
                EXPECT_EQ(bounds.lower[axis], (*low)[axis]);
                EXPECT_EQ(bounds.upper[axis], (*high)[axis]);
            }
        }
    }
}

}  // namespace
}  // namespace mray
