// Costs of trees; and the updater keeps a sound tree under any decisions of a policy.
#include "common/update/tree_updater.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <functional>

#include "common/bvh/box.h"
#include "common/bvh/builder/bvh_builder.h"
#include "cpu/cpu_backend.h"
#include "cpu/refit/refit.h"
#include "tests/support/backend_results.h"
#include "tests/support/test_scene.h"
#include "tests/support/tree_check.h"

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

TEST(CostRatio, DoesNotChangeWithTheSizeOfTheSceneAndIsInfiniteOnceAPointUnfolds) {
    EXPECT_DOUBLE_EQ(cost_ratio({10, 2}, {40, 8}), 1);
    EXPECT_DOUBLE_EQ(cost_ratio({10, 2}, {40, 2}), 4);
    EXPECT_DOUBLE_EQ(cost_ratio({10, 2}, {2.5, 0.5}), 1);
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
    // Trees that were built in a point or are flat.
    EXPECT_DOUBLE_EQ(overhead_visits({0, 0, 0}, {40, 2, 5}), 8);
    EXPECT_EQ(overhead_visits({10, 2, 5}, {0, 0, 0}), 0);
    EXPECT_EQ(overhead_visits({0, 0, 0}, {0, 0, 0}), 0);
}

using Clock = std::chrono::steady_clock;

/// Decides by scripts, one plan a frame and one decision a review, then refits. Keeps the costs
/// that it is told.
class Scripted final : public UpdatePolicy {
public:
    Scripted(std::vector<UpdateDecision> reviews, std::vector<UpdateStep> plans,
             std::vector<FrameCost>& costs)
        : reviews_(std::move(reviews)), plans_(std::move(plans)), costs_(costs) {}
    UpdateDecision plan() override {
        return {planned_ < plans_.size() ? plans_[planned_++] : UpdateStep::kRefit, "scripted"};
    }
    UpdateDecision review(const RefittedTree&) override {
        return reviewed_ < reviews_.size() ? reviews_[reviewed_++] : UpdateDecision{};
    }
    bool needs_tree_cost() const override { return true; }
    void frame_done(const FrameCost& cost) override { costs_.push_back(cost); }

private:
    std::vector<UpdateDecision> reviews_;
    std::vector<UpdateStep> plans_;
    std::vector<FrameCost>& costs_;
    std::size_t planned_ = 0, reviewed_ = 0;
};

std::vector<vec3> turned(const TestScene& scene, int step) {
    std::vector<vec3> positions = scene.positions();
    for (std::size_t i = 0; i < positions.size(); ++i) {
        const double angle = 0.3 * step * static_cast<double>(i / 3 % 7);
        const vec3 p = positions[i];
        positions[i] = snap_point({static_cast<float>(0.5 * (p.x * cos(angle) - p.y * sin(angle))),
                                   static_cast<float>(0.5 * (p.x * sin(angle) + p.y * cos(angle))),
                                   0.5f * p.z});
    }
    return positions;
}

struct Rig {
    explicit Rig(const std::vector<UpdateDecision>& reviews = {}, const UpdateConfig& config = {},
                 const std::vector<UpdateStep>& plans = {})
        : updater(scene.topology(), pose, *tracer,
                  std::make_unique<Scripted>(reviews, plans, costs), {}, config) {}

    TreeStep update(const std::vector<vec3>& positions) {
        pose.move_to(positions);
        updater.update();
        EXPECT_EQ(check_bvh(tree_of(*tracer), scene.topology(), positions),
                  std::vector<std::string>{});
        updater.frame_done({.ms = 1, .rays = 1000});
        const UpdateTimes& times = updater.last().times;
        for (const double ms : {times.refit_ms, times.rebuild_ms, times.upload_ms})
            EXPECT_GE(ms, 0);
        return updater.last().step;
    }

    TestScene scene = random_soup(3000, 0.1, 8);
    Pose pose = scene.pose();
    std::unique_ptr<Backend> tracer = cpu::make_cpu_backend();
    std::vector<FrameCost> costs;
    TreeUpdater updater;
};

TEST(TreeUpdater, TreeIsSoundAfterEveryKindOfStep) {
    const UpdateDecision refit = {UpdateStep::kRefit, ""};
    const UpdateDecision rebuild = {UpdateStep::kRebuild, ""};
    const UpdateDecision background = {UpdateStep::kRebuildInBackground, "", 2};
    Rig rig({refit, rebuild, background, refit, refit, background, rebuild, refit, refit},
            {.deterministic = true});
    std::vector<TreeStep> steps;
    for (int step = 0; step < 9; ++step) steps.push_back(rig.update(turned(rig.scene, step)));
    using enum TreeStep;
    EXPECT_EQ(steps, (std::vector{kRefitted, kRebuilt, kRefitted, kRefitted, kSwapped, kRefitted,
                                  kRebuilt, kRefitted, kRefitted}));
}

TEST(TreeUpdater, UnchangedPoseIsKept) {
    Rig rig;
    EXPECT_EQ(rig.update(rig.scene.positions()), TreeStep::kKept);
    EXPECT_EQ(rig.update(turned(rig.scene, 1)), TreeStep::kRefitted);
    EXPECT_EQ(rig.update(turned(rig.scene, 1)), TreeStep::kKept);
}

TEST(TreeUpdater, BackgroundBuildIsTakenWhenItIsReady) {
    Rig rig({{UpdateStep::kRebuildInBackground, "", 1}});
    EXPECT_EQ(rig.update(turned(rig.scene, 1)), TreeStep::kRefitted);
    EXPECT_TRUE(rig.updater.last().build_pending);
    // The build takes milliseconds.
    const auto deadline = Clock::now() + std::chrono::seconds(60);
    while (rig.update(turned(rig.scene, 2)) != TreeStep::kSwapped)
        ASSERT_LT(Clock::now(), deadline) << "the tree is not taken";
    EXPECT_FALSE(rig.updater.last().build_pending);
    EXPECT_FALSE(rig.updater.last().reason.empty());
}

/// Restructures in the first frame and rebuilds in the second.
Rig restructuring_rig(const UpdateConfig& config) {
    return Rig({{UpdateStep::kRestructure, "scripted"}}, config,
               {UpdateStep::kRefit, UpdateStep::kRebuild});
}

// lab/notes/updates.md has the times of the stages.
TEST(TreeUpdater, CountsARestructuringAboveARefitAndBelowABuild) {
    Rig rig = restructuring_rig({.deterministic = true});
    const std::vector<FrameCost>& costs = rig.costs;
    for (int step = 1; step <= 2; ++step) rig.update(turned(rig.scene, step));
    ASSERT_EQ(costs.size(), 2u);
    EXPECT_GT(costs[0].refit, 0);
    EXPECT_GT(costs[0].restructure, costs[0].refit);
    EXPECT_EQ(costs[0].rebuild, 0);
    EXPECT_EQ(costs[1].restructure, 0);
    EXPECT_GT(costs[1].rebuild, costs[0].restructure);
}

TEST(TreeUpdater, FirstFrameDoesNotReportTheFirstBuildAgain) {
    Rig rig({}, {.deterministic = true});
    rig.updater.frame_done({.ms = 1, .rays = 1000});
    ASSERT_EQ(rig.costs.size(), 1u);
    EXPECT_EQ(rig.costs[0].rebuild, 0);
}

TEST(TreeUpdater, TellsThePolicyEachMillisecondOfAnUpdateOnce) {
    Rig rig = restructuring_rig({});
    for (int frame = 0; frame < 3; ++frame) {
        rig.update(turned(rig.scene, 1 + frame));
        const UpdateTimes& times = rig.updater.last().times;
        const FrameCost& cost = rig.costs.back();
        const double told = cost.refit + cost.restructure + cost.rebuild;
        const double taken = times.refit_ms + times.decide_ms + times.upload_ms +
                             times.restructure_ms + times.rebuild_ms;
        // Sums in another order round differently.
        EXPECT_NEAR(told, taken, 1e-9);
        EXPECT_EQ(cost.restructure > 0, frame == 0);
        EXPECT_EQ(cost.rebuild > 0, frame == 1);
        EXPECT_EQ(cost.trace, 1);
    }
}

TEST(TreeUpdater, BackgroundBuildThatIsOlderThanTheTreeIsDropped) {
    // The rebuild comes before the updater looks whether the other build is ready.
    Rig rig({{UpdateStep::kRebuildInBackground, "", 1}}, {},
            {UpdateStep::kRefit, UpdateStep::kRebuild});
    EXPECT_EQ(rig.update(turned(rig.scene, 1)), TreeStep::kRefitted);
    EXPECT_EQ(rig.update(turned(rig.scene, 2)), TreeStep::kRebuilt);
    ASSERT_TRUE(rig.updater.last().build_pending);
    // The build takes milliseconds.
    const auto deadline = Clock::now() + std::chrono::seconds(60);
    while (rig.updater.last().build_pending) {
        ASSERT_LT(Clock::now(), deadline) << "the build is not dropped";
        ASSERT_NE(rig.update(turned(rig.scene, 3)), TreeStep::kSwapped);
    }
}

TEST(TreeUpdater, EndsWhileABackgroundBuildIsPending) {
    Rig rig({{UpdateStep::kRebuildInBackground, "", 5}});
    rig.update(turned(rig.scene, 1));
    EXPECT_TRUE(rig.updater.last().build_pending);
}

TEST(TreeUpdater, CostRatioOfATreeFromTheBackgroundIsThatSinceItsBuild) {
    Rig rig({{UpdateStep::kRebuildInBackground, "", 1}}, {.deterministic = true});
    EXPECT_EQ(rig.update(turned(rig.scene, 3)), TreeStep::kRefitted);
    EXPECT_GT(rig.updater.last().cost_ratio, 1.2);
    EXPECT_EQ(rig.update(turned(rig.scene, 3)), TreeStep::kSwapped);
    EXPECT_EQ(rig.updater.last().cost_ratio, 1);
}

TEST(TreeUpdater, CostRatioOfACopiedTreeIsThatSinceItsBuild) {
    Rig rig;
    const auto tracer = cpu::make_cpu_backend();
    const Bvh tree = tree_of(*rig.tracer);
    TreeUpdater copied(rig.scene.topology(), rig.pose, *tracer,
                       std::unique_ptr<UpdatePolicy>(new Scripted({}, {}, rig.costs)), {}, {},
                       &tree);
    rig.update(turned(rig.scene, 3));
    copied.update();
    EXPECT_GT(copied.last().cost_ratio, 1.2);
    EXPECT_EQ(copied.last().cost_ratio, rig.updater.last().cost_ratio);
}

}  // namespace
}  // namespace mray
