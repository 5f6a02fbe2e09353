#include "scenes/polygons/ear_clipper.h"

#include <gtest/gtest.h>

namespace mray {
namespace {

using Triangles = std::vector<std::array<std::uint32_t, 3>>;

// Teeth along the x axis.
std::vector<PlanePoint> comb(int count) {
    std::vector<PlanePoint> points = {{0, -1}, {double(count), -1}};
    for (int i = count; i >= 0; --i) points.push_back({double(i), i % 2 == 0 ? 10.0 : 0.0});
    return points;
}

TEST(EarClipper, GivesUpWithNothingAppendedWhenTheStepsAreUsedUp) {
    EarClipper clipper;
    Triangles triangles = {{7, 8, 9}};
    EXPECT_FALSE(clipper.clip(comb(100), 150, triangles));
    EXPECT_EQ(triangles, (Triangles{{7, 8, 9}}));
    EXPECT_TRUE(clipper.clip(comb(100), 100'000, triangles));
    EXPECT_EQ(triangles.size(), 1u + comb(100).size() - 2);
}

// An octagon has no reflex corner to search for: each ear takes one step.
TEST(EarClipper, CountsEveryCornerThatItTries) {
    const std::vector<PlanePoint> octagon = {{2, 0},  {1, 1},   {0, 2},  {-1, 1},
                                             {-2, 0}, {-1, -1}, {0, -2}, {1, -1}};
    EarClipper clipper;
    Triangles triangles;
    EXPECT_FALSE(clipper.clip(octagon, 2, triangles));
    EXPECT_TRUE(triangles.empty());
    EXPECT_TRUE(clipper.clip(octagon, 100, triangles));
    EXPECT_EQ(triangles.size(), 6u);
}

TEST(EarClipper, CutsTheOnlyEarsOfAnArrow) {
    const std::vector<PlanePoint> arrow = {{0, 0}, {4, -4}, {1, 0}, {4, 4}};
    EarClipper clipper;
    Triangles triangles;
    ASSERT_TRUE(clipper.clip(arrow, 1000, triangles));
    for (const auto& [a, b, c] : triangles) {
        EXPECT_GT(doubled_area(arrow[a], arrow[b], arrow[c]), 0);
    }
}

}  // namespace
}  // namespace mray
