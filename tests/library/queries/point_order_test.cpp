// Points in an order in which neighbours are near each other.
#include "library/src/queries/point_order.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <random>
#include <vector>

namespace morphray::detail {
namespace {

using mray::vec3;

/// The place of a cell on a Morton curve: the bits of its coordinates in turn, the last axis first.
std::uint64_t curve_place(const vec3& cell, int axes) {
    std::uint64_t place = 0;
    for (int bit = 0; bit < 11; ++bit) {
        for (int axis = 0; axis < axes; ++axis) {
            const auto coordinate = static_cast<std::uint64_t>(cell[axis]);
            place |= (coordinate >> bit & 1) << (bit * axes + axis);
        }
    }
    return place;
}

/// Expects that shuffled points, each a cell of a square or cube, come in the order of the curve.
void expect_curve(std::vector<vec3> points, PointOrder by) {
    std::shuffle(points.begin(), points.end(), std::mt19937(7));
    const std::vector<std::uint32_t> order = order_points(points, by);
    ASSERT_EQ(order.size(), points.size());
    std::vector<std::uint32_t> expected(points.size());
    std::iota(expected.begin(), expected.end(), 0u);
    const int axes = by == PointOrder::columns ? 2 : 3;
    std::stable_sort(expected.begin(), expected.end(), [&](std::uint32_t a, std::uint32_t b) {
        return curve_place(points[a], axes) < curve_place(points[b], axes);
    });
    EXPECT_EQ(order, expected);
}

/// Points of each cell of a grid.
std::vector<vec3> grid(int width, int height, int depth) {
    std::vector<vec3> points;
    for (int z = 0; z < depth; ++z)
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) points.emplace_back(x, y, z);
    return points;
}

std::vector<vec3> diagonal(int length) {
    std::vector<vec3> points;
    for (int i = 0; i < length; ++i) points.emplace_back(i, i, i);
    return points;
}

TEST(PointOrder, FollowsAMortonCurveInSpace) {
    expect_curve(grid(16, 16, 16), PointOrder::places);
    expect_curve(grid(128, 1, 1), PointOrder::places);
    expect_curve(grid(1, 64, 64), PointOrder::places);
    expect_curve(diagonal(128), PointOrder::places);
}

TEST(PointOrder, FollowsAMortonCurveAcrossColumns) {
    expect_curve(grid(64, 64, 1), PointOrder::columns);
    expect_curve(diagonal(2048), PointOrder::columns);
}

TEST(PointOrder, KeepsTheOrderOfPointsInOneColumn) {
    std::vector<vec3> points;
    for (int i = 0; i < 100; ++i) points.emplace_back(i % 4, 0, 100 - i);
    const std::vector<std::uint32_t> order = order_points(points, PointOrder::columns);
    for (std::size_t i = 0; i < order.size(); ++i) EXPECT_EQ(order[i], i % 25 * 4 + i / 25);
}

TEST(PointOrder, IsAPermutationOfPointsThatAreNotFinite) {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
    std::vector<vec3> points = grid(4, 4, 4);
    std::size_t next = 5;
    for (const float odd : {kInfinity, -kInfinity, kNaN})
        for (int axis = 0; axis < 3; ++axis, next += 6) points[next][axis] = odd;
    for (const PointOrder by : {PointOrder::places, PointOrder::columns}) {
        std::vector<std::uint32_t> order = order_points(points, by);
        std::sort(order.begin(), order.end());
        ASSERT_EQ(order.size(), points.size());
        for (std::size_t i = 0; i < order.size(); ++i) EXPECT_EQ(order[i], i);
    }
    EXPECT_TRUE(order_points({}, PointOrder::places).empty());
}

}  // namespace
}  // namespace morphray::detail
