#include "common/update/tree_updater.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/bvh/box.h"
#include "common/bvh/builder/bvh_builder.h"
#include "cpu/refit/refit.h"
#include "tests/support/test_scene.h"

namespace mray {
namespace {

using namespace test;

double cost_at_build(const TestScene& scene) {
    return tree_cost(build_bvh(scene.topology(), scene.positions()).nodes);
}

TEST(TreeCost, IsFiniteForEveryScene) {
    for (const NamedScene& named : adversarial_scenes()) {
        EXPECT_TRUE(std::isfinite(cost_at_build(named.scene))) << named.name;
        const double area = TriangleSample(named.scene.topology()).area(named.scene.positions());
        EXPECT_TRUE(std::isfinite(area)) << named.name;
        EXPECT_GE(area, 0) << named.name;
    }
}

TEST(TreeCost, OfPoseOutOfOrderIsManyTimesThatOfTheBuild) {
    const TestScene scene = random_soup(4000, 0.02, 3);
    std::vector<vec3> shuffled = scene.positions();
    Random random(5);
    for (std::size_t i = shuffled.size() / 3; i-- > 1;) {
        const std::size_t j = random.below(static_cast<std::uint32_t>(i + 1));
        for (std::size_t k = 0; k < 3; ++k) std::swap(shuffled[3 * i + k], shuffled[3 * j + k]);
    }
    const TriangleSample sample(scene.topology());
    const TreeFit built = {cost_at_build(scene), sample.area(scene.positions())};
    Bvh bvh = build_bvh(scene.topology(), scene.positions());
    cpu::refit(bvh, shuffled);
    const double area = sample.area(shuffled);
    EXPECT_EQ(cost_ratio(built, built), 1);
    EXPECT_GT(cost_ratio(built, {tree_cost(bvh.nodes), area}), 10);
    const Bvh rebuilt = build_bvh(scene.topology(), shuffled);
    EXPECT_NEAR(cost_ratio(built, {tree_cost(rebuilt.nodes), area}), 1, 0.05);
}

TEST(CostRatio, DoesNotChangeWithTheSizeOfTheScene) {
    EXPECT_DOUBLE_EQ(cost_ratio({10, 2}, {40, 8}), 1);
    EXPECT_DOUBLE_EQ(cost_ratio({10, 2}, {40, 2}), 4);
    EXPECT_DOUBLE_EQ(cost_ratio({10, 2}, {2.5, 0.5}), 1);
}

TEST(CostRatio, OfATreeBuiltInAPointIsInfiniteOnceItUnfolds) {
    EXPECT_EQ(cost_ratio({0, 0}, {0, 0}), 1);
    EXPECT_TRUE(std::isinf(cost_ratio({0, 0}, {1, 1})));
    EXPECT_EQ(cost_ratio({5, 1}, {0, 0}), 0);
    EXPECT_EQ(cost_ratio({5, 0}, {10, 1}), 2);
}

TEST(TriangleSample, LeavesTrianglesOutThatAreNotFinite) {
    const TestScene scene({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {NAN, 1, 1}}, {{0, 1, 2}, {0, 1, 3}});
    const TestScene finite({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}});
    const double area = TriangleSample(scene.topology()).area(scene.positions());
    EXPECT_GT(area, 0);
    EXPECT_EQ(area, TriangleSample(finite.topology()).area(finite.positions()));
}

TEST(OverheadVisits, AreTheGrowthBeyondThatOfTheTrianglesOverTheRoot) {
    EXPECT_EQ(overhead_visits({10, 2, 5}, {10, 2, 5}), 0);
    EXPECT_EQ(overhead_visits({10, 2, 5}, {40, 8, 20}), 0);
    EXPECT_DOUBLE_EQ(overhead_visits({10, 2, 5}, {40, 2, 5}), 6);
    EXPECT_DOUBLE_EQ(overhead_visits({10, 2, 5}, {40, 4, 10}), 2);
    EXPECT_EQ(overhead_visits({40, 2, 5}, {10, 2, 5}), 0);
}

TEST(OverheadVisits, AreFiniteForTreesThatWereBuiltInAPointOrAreFlat) {
    EXPECT_DOUBLE_EQ(overhead_visits({0, 0, 0}, {40, 2, 5}), 8);
    EXPECT_EQ(overhead_visits({10, 2, 5}, {0, 0, 0}), 0);
    EXPECT_EQ(overhead_visits({0, 0, 0}, {0, 0, 0}), 0);
}

}  // namespace
}  // namespace mray
