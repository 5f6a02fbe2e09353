#include "scenes/polygons/ear_clipper.h"

#include <gtest/gtest.h>

#include <limits>
#include <numeric>
#include <random>
#include <set>

namespace mray {
namespace {

constexpr std::size_t kManySteps = std::numeric_limits<std::size_t>::max();

std::set<std::uint32_t> found(const PointTree& tree, PlanePoint lower, PlanePoint upper) {
    std::set<std::uint32_t> members;
    std::size_t steps = kManySteps;
    tree.any_in_box(lower, upper, steps, [&](std::uint32_t member) {
        EXPECT_TRUE(members.insert(member).second);
        return false;
    });
    return members;
}

TEST(PointTree, FindsWhatAScanFindsWhilePointsAreTakenAway) {
    std::mt19937 random(7);
    for (const int grid : {3, 1000}) {  // 3: most points coincide
        std::uniform_int_distribution<int> coordinate(0, grid);
        std::vector<PlanePoint> points(500);
        for (PlanePoint& p : points) p = {double(coordinate(random)), double(coordinate(random))};
        std::vector<std::uint32_t> members;
        for (std::uint32_t i = 0; i < points.size(); i += 2) members.push_back(i);
        PointTree tree;
        tree.build(points, members);
        std::set<std::uint32_t> there(members.begin(), members.end());
        while (!there.empty()) {
            PlanePoint lower = {double(coordinate(random)), double(coordinate(random))};
            PlanePoint upper = {double(coordinate(random)), double(coordinate(random))};
            std::set<std::uint32_t> expected;
            for (const std::uint32_t i : there) {
                const PlanePoint p = points[i];
                if (p.x >= lower.x && p.x <= upper.x && p.y >= lower.y && p.y <= upper.y) {
                    expected.insert(i);
                }
            }
            ASSERT_EQ(found(tree, lower, upper), expected);
            const auto gone = std::next(there.begin(), random() % there.size());
            tree.remove(*gone);
            there.erase(gone);
        }
    }
}

TEST(PointTree, OfNothingFindsNothing) {
    PointTree tree;
    tree.build({}, {});
    EXPECT_TRUE(found(tree, {-1, -1}, {1, 1}).empty());
}

TEST(PointTree, GivesUpWhenTheStepsAreUsedUp) {
    std::vector<PlanePoint> points(100);
    std::vector<std::uint32_t> members(100);
    std::iota(members.begin(), members.end(), 0u);
    PointTree tree;
    tree.build(points, members);
    std::size_t steps = 10;
    EXPECT_TRUE(tree.any_in_box({0, 0}, {0, 0}, steps, [](std::uint32_t) { return false; }));
    EXPECT_EQ(steps, 0u);
}

}  // namespace
}  // namespace mray
