#include "common/update/policy.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tests/support/thrown_error.h"

namespace mray {
namespace {

/// A tree whose degradation is known: it takes `sound` to trace when new, a build costs `build`.
struct DegradingTree {
    double sound = 10;
    double build = 5;
    double refit = 0.1;
    double restructure = 0.5;
    /// The part of the overhead that a restructuring removes.
    double cure = 0;
    /// The overhead by the frames since the build, and the time of a trace by the overhead.
    double (*overhead)(int age) = [](int age) { return 60.0 * age; };
    double (*slowdown)(double) = [](double visits) { return 1 + 0.001 * visits; };
};

struct Played {
    std::vector<UpdateStep> steps;
    double total = 0;
    int rebuilds = 0;
    int restructurings = 0;
};

/// Plays frames as TreeUpdater does; a background build ends before the next frame.
Played play(UpdatePolicy& policy, const DegradingTree& tree, int frames) {
    policy.built(tree.build);
    // The frame of the build.
    policy.frame_done({.trace = tree.sound});
    Played played;
    int age = 0;
    double cured = 0;  // of the overhead, by restructurings
    bool pending = false;
    for (int frame = 0; frame < frames; ++frame) {
        FrameCost cost;
        ++age;
        UpdateDecision decision = policy.plan();
        if (decision.step == UpdateStep::kRefit) {
            cost.refit = tree.refit;
            cost.new_tree = pending;
            if (pending) {
                age = 1;
                cured = 0;
            }
            pending = false;
            decision = policy.review({.overhead = tree.overhead(age) - cured});
        }
        if (decision.step == UpdateStep::kRestructure) {
            cost.restructure = tree.restructure;
            cured += tree.cure * (tree.overhead(age) - cured);
            ++played.restructurings;
            decision =
                policy.review({.overhead = tree.overhead(age) - cured, .restructured = true});
        }
        if (decision.step == UpdateStep::kRebuild) {
            age = 0;
            cured = 0;
            cost.rebuild = tree.build;
            cost.new_tree = true;
            ++played.rebuilds;
        }
        if (decision.step == UpdateStep::kRebuildInBackground) {
            pending = true;
            ++played.rebuilds;
        }
        cost.overhead = tree.overhead(age) - cured;
        cost.trace = tree.sound * tree.slowdown(cost.overhead);
        cost.build_pending = pending;
        policy.frame_done(cost);
        played.steps.push_back(decision.step);
        played.total += cost.refit + cost.restructure + cost.rebuild + cost.trace;
    }
    return played;
}

Played play(const char* policy, const DegradingTree& tree, int frames) {
    return play(*make_update_policy(parse_policy(policy)), tree, frames);
}

TEST(UpdatePolicy, EveryKRebuildsEachKthFrame) {
    const Played played = play("every:4", {}, 12);
    for (std::size_t i = 0; i < played.steps.size(); ++i) {
        const UpdateStep expected = i % 4 == 3 ? UpdateStep::kRebuild : UpdateStep::kRefit;
        EXPECT_EQ(played.steps[i], expected) << i;
    }
    EXPECT_EQ(play("every:1", {}, 12).rebuilds, 12);
    EXPECT_EQ(play("rebuild", {}, 12).rebuilds, 12);
    EXPECT_EQ(play("refit", {}, 12).rebuilds, 0);
}

TEST(UpdatePolicy, TextsThatAreNoneAreRefusedWithAllForms) {
    for (const char* text : {"", "refitt", "every", "every:", "every:0", "every:-1", "every:x",
                             "every:2000000", "auto:", "auto:3", "rebuild:1", ":"}) {
        const std::optional<Error> error = test::error_of([&] { parse_policy(text); });
        ASSERT_TRUE(error) << text;
        EXPECT_EQ(error->kind(), ErrorKind::kBadArgument) << text;
        EXPECT_TRUE(test::has(error->what(), "every:K")) << text;
    }
}

TEST(AutoPolicy, IsAsGoodAsTheBestPeriodWhereRotIsEvenAndNothingElseHelps) {
    DegradingTree tree;
    tree.overhead = [](int age) { return 15.0 * age; };
    for (const double build : {0.5, 2.0, 4.0}) {
        tree.build = build;
        double best = play("refit", tree, 400).total;
        for (int period = 1; period < 60; ++period) {
            const std::string every = "every:" + std::to_string(period);
            best = std::min(best, play(every.c_str(), tree, 400).total);
        }
        EXPECT_LE(play("auto", tree, 400).total, 1.03 * best) << build;
    }
}

TEST(AutoPolicy, LossesBeforeARestructuringDoNotCallForTheNext) {
    DegradingTree tree;
    tree.cure = 1;
    tree.overhead = [](int age) { return 15.0 * age; };
    EXPECT_LE(play("auto", tree, 400).restructurings, 220);
}

TEST(AutoPolicy, WaitsWhereADegradedTreeIsSeenToTraceNoSlower) {
    DegradingTree tree;
    tree.overhead = [](int age) { return 200.0 * age; };
    EXPECT_GT(play("auto", tree, 8).rebuilds, 0);
    tree.slowdown = [](double) { return 1.0; };
    EXPECT_EQ(play("auto", tree, 8).rebuilds, 0);
}

TEST(AutoPolicy, RebuildsWhatRestructuringLeaves) {
    DegradingTree tree;
    tree.cure = 0.7;
    const Played played = play("auto", tree, 400);
    EXPECT_GT(played.restructurings, played.rebuilds);
    EXPECT_GT(played.rebuilds, 0);
}

TEST(AutoPolicy, DoesNotBlameTheTreeForAnImageThatTakesLonger) {
    const auto policy = make_update_policy({PolicyKind::kAuto});
    policy->built(5);
    for (int frame = 0; frame < 200; ++frame) {
        ASSERT_EQ(policy->review({.overhead = 0}).step, UpdateStep::kRefit) << frame;
        policy->frame_done({.refit = 0.1, .trace = 10.0 + frame});
    }
}

TEST(AutoPolicy, LearnsWithinReasonWhateverClocksSay) {
    const auto policy = make_update_policy({PolicyKind::kAuto});
    policy->built(5);
    for (int i = 0; i < 50; ++i) {
        policy->frame_done({.refit = 0.1, .trace = 1e6, .overhead = 120});
        policy->frame_done({.refit = 0.1, .rebuild = 5, .trace = 1e-6, .new_tree = true});
    }
    // At most 20 times the first guess a visit.
    EXPECT_TRUE(policy->review({.overhead = 0.4}).reason.starts_with("sound"));
}

TEST(AutoPolicy, BuildsThatDoNotHelpBecomeRare) {
    DegradingTree tree;
    tree.overhead = [](int age) { return std::min(600.0, 200.0 * age); };
    tree.slowdown = [](double) { return 1.0; };
    const auto policy = make_update_policy({PolicyKind::kAuto});
    const int early = play(*policy, tree, 50).rebuilds;
    play(*policy, tree, 200);
    const int late = play(*policy, tree, 50).rebuilds;
    EXPECT_GT(early, 0);
    EXPECT_LT(late, early);
}

TEST(AutoPolicy, DoesNotFlapAtARatioThatSwingsAroundSound) {
    DegradingTree tree;
    tree.overhead = [](int age) { return age % 2 == 0 ? 5.0 : 23.0; };
    // Every other frame loses 0.23 ms, 58 ms in all: no more than 12 builds of 5 ms.
    EXPECT_LE(play("auto", tree, 500).rebuilds, 12);
}

TEST(AutoPolicy, RestructuringIsCutToTheBudget) {
    const auto policy = make_update_policy({PolicyKind::kAuto}, {.budget_ms = 4});
    policy->built(20);
    policy->frame_done({.refit = 0.1, .trace = 100});
    const UpdateDecision decision = policy->review({.overhead = 300});
    ASSERT_EQ(decision.step, UpdateStep::kRestructure);
    // A restructured triangle costs twice as much as one of a build: 0.1 * 2 * 20 ms.
    EXPECT_DOUBLE_EQ(decision.most_restructured, 0.1);
}

// Whatever a scene does, as long as the model is right about what a tree loses.
TEST(AutoPolicy, IsWithinATwentiethOfTheBetterOfRefitAndRebuildInShortAnimations) {
    for (const double visits : {3.0, 30.0, 100.0, 300.0, 5000.0}) {
        for (const double build : {0.3, 3.0, 30.0}) {
            for (const double cure : {0.0, 1.0}) {
                static double growth;
                growth = visits;
                DegradingTree tree;
                tree.build = build;
                tree.restructure = (cure > 0 ? 0.4 : 0.02) * build;
                tree.cure = cure;
                tree.overhead = [](int age) { return std::min(growth * age, 5000.0); };
                for (const int frames : {3, 5, 10}) {
                    const double better = std::min(play("refit", tree, frames).total,
                                                   play("rebuild", tree, frames).total);
                    EXPECT_LE(play("auto", tree, frames).total, 1.05 * better)
                        << visits << ' ' << build << ' ' << cure << ' ' << frames;
                }
            }
        }
    }
}

TEST(AutoPolicy, TreesThatAreTooLateWhenTheyAreTakenDoNotBegetOthers) {
    const auto policy = make_update_policy({PolicyKind::kAuto});
    policy->built(1e6);
    policy->frame_done({.refit = 0.1, .trace = 10, .overhead = 400, .new_tree = true});
    for (int frame = 0; frame < 100; ++frame) {
        const UpdateDecision decision =
            policy->review({.overhead = 400, .restructured = frame % 2 == 0});
        ASSERT_NE(decision.step, UpdateStep::kRebuildInBackground) << frame;
        policy->frame_done({.refit = 0.1, .trace = 10, .overhead = 400});
    }
}

TEST(AutoPolicy, TreeThatIsHopelessIsRebuiltOnceBeforeItsFirstTrace) {
    const auto policy = make_update_policy({PolicyKind::kAuto});
    policy->built(50);
    policy->frame_done({.new_tree = true});
    EXPECT_EQ(policy->review({.overhead = 100}).step, UpdateStep::kRefit);
    policy->frame_done({.refit = 0.1, .overhead = 100});
    EXPECT_EQ(policy->review({.overhead = 1e6}).step, UpdateStep::kRebuild);
    policy->frame_done({.refit = 0.1, .rebuild = 50, .new_tree = true});
    for (int frame = 0; frame < 20; ++frame) {
        ASSERT_EQ(policy->review({.overhead = 1e6}).step, UpdateStep::kRefit) << frame;
        policy->review({.overhead = 1e6, .restructured = true});
        policy->frame_done({.refit = 0.1, .overhead = 1e6});
    }
}

TEST(AutoPolicy, UpdatesBetweenTracesDoNotHideADegradedTree) {
    // As where a simulator moves cloth and then bodies, and renders.
    const auto policy = make_update_policy({PolicyKind::kAuto});
    policy->built(5);
    UpdateStep step = UpdateStep::kRefit;
    for (int frame = 0; frame < 4 && step == UpdateStep::kRefit; ++frame) {
        policy->review({.overhead = 450});
        policy->frame_done({.refit = 0.1, .overhead = 450});
        step = policy->review({.overhead = 450}).step;
        policy->frame_done({.refit = 0.1, .trace = 30, .overhead = 450});
    }
    EXPECT_EQ(step, UpdateStep::kRestructure);
}

TEST(AutoPolicy, TreeThatProlongsTheFirstTraceByHalfIsRebuilt) {
    // As where bodies leave the place in which they were attached.
    const UpdateConfig config{.first_per_visit = 0.001};
    for (const double overhead : {490.0, 510.0}) {
        const UpdateStep step =
            make_update_policy({PolicyKind::kAuto}, config)->review({.overhead = overhead}).step;
        EXPECT_EQ(step, overhead > 500 ? UpdateStep::kRebuild : UpdateStep::kRefit) << overhead;
    }
}

TEST(AutoPolicy, SingleRaysLoseMoreByABadTreeThanPackets) {
    for (const double single_part : {0.0, 1.0}) {
        const auto policy = make_update_policy({PolicyKind::kAuto}, {.first_per_visit = 0.001});
        policy->built(5);
        policy->frame_done({.trace = 10, .single_part = single_part});
        EXPECT_EQ(policy->review({.overhead = 120}).step,
                  single_part > 0 ? UpdateStep::kRestructure : UpdateStep::kRefit);
    }
}

TEST(AutoPolicy, UpdatesBetweenTracesRebuildOnce) {
    const auto policy = make_update_policy({PolicyKind::kAuto}, {.budget = 100});
    policy->built(30);
    policy->frame_done({.trace = 10});
    double overhead = 0;
    int all_rebuilds = 0;
    for (int frame = 0; frame < 100; ++frame) {
        int rebuilds = 0;
        for (int update = 1; update <= 5; ++update) {
            FrameCost cost{.refit = 0.5};
            overhead += 20;
            UpdateStep step = policy->review({.overhead = overhead}).step;
            if (step == UpdateStep::kRestructure) {
                cost.restructure = 1;
                step = policy->review({.overhead = overhead, .restructured = true}).step;
            }
            if (step == UpdateStep::kRebuild) {
                ++rebuilds;
                overhead = 0;
                cost.rebuild = 30;
                cost.new_tree = true;
            }
            cost.overhead = overhead;
            if (update == 5) cost.trace = 10 + 0.01 * overhead;
            policy->frame_done(cost);
        }
        ASSERT_LE(rebuilds, 1) << frame;
        all_rebuilds += rebuilds;
    }
    EXPECT_GT(all_rebuilds, 0);
}

TEST(AutoPolicy, BuildOverTheBudgetRunsInTheBackground) {
    for (const UpdateConfig& config :
         {UpdateConfig{.budget = 0.25}, UpdateConfig{.budget = 100, .budget_ms = 2.5}}) {
        const auto policy = make_update_policy({PolicyKind::kAuto}, config);
        policy->built(20);
        UpdateDecision decision;
        for (int frame = 0; frame < 100 && decision.step == UpdateStep::kRefit; ++frame) {
            decision = policy->review({.overhead = 150});
            if (decision.step == UpdateStep::kRestructure)
                decision = policy->review({.overhead = 150, .restructured = true});
            policy->frame_done({.refit = 0.1, .trace = 9.9, .overhead = 150});
        }
        EXPECT_EQ(decision.step, UpdateStep::kRebuildInBackground);
        EXPECT_EQ(decision.build_frames, 8u);  // 20 ms, 2.5 ms a frame
    }
}

TEST(AutoPolicy, WhileABuildIsPendingNoOtherIsBegun) {
    const auto policy = make_update_policy({PolicyKind::kAuto});
    policy->built(20);
    for (int frame = 0; frame < 100; ++frame) {
        const UpdateDecision decision =
            policy->review({.overhead = 150, .build_pending = true, .restructured = true});
        ASSERT_EQ(decision.step, UpdateStep::kRefit) << frame;
        policy->frame_done({.refit = 0.1, .trace = 10, .overhead = 150, .build_pending = true});
    }
}

}  // namespace
}  // namespace mray
