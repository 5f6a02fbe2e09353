#include "common/update/policy/update_policy.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "common/base/errors.h"
#include "common/update/policy/slowdown_model.h"

namespace mray {
namespace {

/// A tree whose degradation is known: it takes `sound` to trace when new, a build costs `build`.
struct Clip {
    double sound = 10;
    double build = 5;
    double refit = 0.1;
    double restructure = 0.5;
    /// The part of the ratio above 1 that a restructuring removes.
    double cure = 0;
    /// The cost ratio by the frames since the build, and the time of a trace by the ratio.
    double (*ratio)(int age) = [](int age) { return 1 + 0.2 * age; };
    double (*slowdown)(double) = [](double r) { return std::pow(r, 0.3); };
};

struct Played {
    std::vector<UpdateStep> steps;
    double total = 0;
    double worst_slowdown = 1;
    int rebuilds = 0;
    int restructurings = 0;
};

/// Plays frames as TreeUpdater does; a background build ends before the next frame.
Played play(UpdatePolicy& policy, const Clip& clip, int frames) {
    policy.built(clip.build);
    Played played;
    int age = 0;
    double cured = 0;  // of the ratio, by restructurings
    bool pending = false;
    for (int frame = 0; frame < frames; ++frame) {
        FrameCost cost;
        ++age;
        UpdateDecision decision = policy.plan();
        if (decision.step == UpdateStep::kRefit) {
            cost.refit = clip.refit;
            cost.new_tree = pending;
            if (pending) {
                age = 1;
                cured = 0;
            }
            pending = false;
            decision = policy.review({.cost_ratio = clip.ratio(age) - cured});
        }
        if (decision.step == UpdateStep::kRestructure) {
            cost.restructure = clip.restructure;
            cured += clip.cure * (clip.ratio(age) - cured - 1);
            ++played.restructurings;
            decision = policy.review({.cost_ratio = clip.ratio(age) - cured, .restructured = true});
        }
        if (decision.step == UpdateStep::kRebuild) {
            age = 0;
            cured = 0;
            cost.rebuild = clip.build;
            cost.new_tree = true;
            ++played.rebuilds;
        }
        if (decision.step == UpdateStep::kRebuildInBackground) {
            pending = true;
            ++played.rebuilds;
        }
        cost.cost_ratio = clip.ratio(age) - cured;
        cost.trace = clip.sound * clip.slowdown(cost.cost_ratio);
        played.worst_slowdown = std::max(played.worst_slowdown, cost.trace / clip.sound);
        cost.build_pending = pending;
        policy.frame_done(cost);
        played.steps.push_back(decision.step);
        played.total += cost.refit + cost.restructure + cost.rebuild + cost.trace;
    }
    return played;
}

Played play(const char* policy, const Clip& clip, int frames) {
    return play(*make_update_policy(policy), clip, frames);
}

TEST(UpdatePolicy, RefitNeverRebuildsAndRebuildAlwaysDoes) {
    EXPECT_EQ(play("refit", {}, 20).rebuilds, 0);
    EXPECT_EQ(play("rebuild", {}, 20).rebuilds, 20);
}

TEST(UpdatePolicy, EveryKRebuildsEachKthFrame) {
    const Played played = play("every:4", {}, 12);
    for (std::size_t i = 0; i < played.steps.size(); ++i) {
        const UpdateStep expected = i % 4 == 3 ? UpdateStep::kRebuild : UpdateStep::kRefit;
        EXPECT_EQ(played.steps[i], expected) << i;
    }
    EXPECT_EQ(play("every:1", {}, 12).rebuilds, 12);
}

TEST(UpdatePolicy, EveryDecisionHasAReason) {
    for (const char* name : {"refit", "rebuild", "every:3", "auto"}) {
        const auto policy = make_update_policy(name);
        policy->built(5);
        EXPECT_FALSE(policy->plan().reason.empty()) << name;
        EXPECT_FALSE(policy->review({2, false}).reason.empty()) << name;
    }
}

TEST(UpdatePolicy, TextsThatAreNoneAreRefusedWithAllForms) {
    for (const char* text : {"", "refitt", "every", "every:", "every:0", "every:-1", "every:x",
                             "every:2000000", "auto:", "auto:3", "rebuild:1", ":"}) {
        try {
            make_update_policy(text);
            ADD_FAILURE() << text;
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kBadArgument) << text;
            EXPECT_NE(std::string(error.what()).find("every:K"), std::string::npos) << text;
        }
    }
}

TEST(AutoPolicy, IsAsGoodAsTheBestPeriodWhereRotIsEvenAndNothingElseHelps) {
    Clip clip;
    clip.ratio = [](int age) { return 1 + 0.05 * age; };
    for (const double build : {0.5, 2.0, 4.0}) {
        clip.build = build;
        double best = play("refit", clip, 400).total;
        for (int period = 1; period < 60; ++period) {
            const std::string every = "every:" + std::to_string(period);
            best = std::min(best, play(every.c_str(), clip, 400).total);
        }
        EXPECT_LE(play("auto", clip, 400).total, 1.03 * best) << build;
    }
}

TEST(AutoPolicy, RestructuresInsteadWhereThatCures) {
    Clip clip;
    clip.cure = 1;
    clip.build = 20;
    const Played played = play("auto", clip, 400);
    EXPECT_EQ(played.rebuilds, 0);
    EXPECT_GT(played.restructurings, 10);
    EXPECT_LT(played.total, 0.95 * play("every:8", clip, 400).total);
}

TEST(AutoPolicy, RebuildsWhatRestructuringLeaves) {
    Clip clip;
    clip.cure = 0.7;
    const Played played = play("auto", clip, 400);
    EXPECT_GT(played.restructurings, played.rebuilds);
    EXPECT_GT(played.rebuilds, 0);
}

TEST(AutoPolicy, RestructuringsThatDoNotHelpBecomeRare) {
    Clip clip;
    EXPECT_LE(play("auto", clip, 400).restructurings, 12);
}

TEST(AutoPolicy, NeverRebuildsATreeThatDoesNotRot) {
    Clip clip;
    clip.ratio = [](int) { return 1.04; };
    EXPECT_EQ(play("auto", clip, 500).rebuilds, 0);
}

TEST(AutoPolicy, DoesNotBlameTheTreeForAnImageThatTakesLonger) {
    const auto policy = make_update_policy("auto");
    policy->built(5);
    for (int frame = 0; frame < 200; ++frame) {
        ASSERT_EQ(policy->review({1.0, false}).step, UpdateStep::kRefit) << frame;
        policy->frame_done({.refit = 0.1, .trace = 10.0 + frame});
    }
}

TEST(AutoPolicy, BuildsThatDoNotHelpBecomeRare) {
    Clip clip;
    clip.ratio = [](int age) { return std::min(3.0, 1 + 0.5 * age); };
    clip.slowdown = [](double) { return 1.0; };
    const auto policy = make_update_policy("auto");
    const int early = play(*policy, clip, 50).rebuilds;
    play(*policy, clip, 200);
    const int late = play(*policy, clip, 50).rebuilds;
    EXPECT_GT(early, 0);
    EXPECT_LT(late, early);
}

TEST(AutoPolicy, DoesNotFlapAtARatioThatSwingsAroundSound) {
    Clip clip;
    clip.ratio = [](int age) { return age % 2 == 0 ? 1.02 : 1.08; };
    // Every other frame loses 0.23 ms, 58 ms in all: no more than 12 builds of 5 ms.
    EXPECT_LE(play("auto", clip, 500).rebuilds, 12);
}

TEST(AutoPolicy, JumpThatRestructuringLeavesIsRebuiltAtOnceWhateverTheBudget) {
    const auto policy = make_update_policy("auto", {.budget = 1e-6});
    policy->built(50);
    policy->frame_done({.refit = 0.1, .trace = 100});
    EXPECT_EQ(policy->review({.cost_ratio = 100}).step, UpdateStep::kRestructure);
    EXPECT_EQ(policy->review({.cost_ratio = 100, .restructured = true}).step, UpdateStep::kRebuild);
}

TEST(AutoPolicy, LeapBeyondWhatTheModelKnowsIsRebuiltAtOnce) {
    const auto policy = make_update_policy("auto", {.budget = 1e-6});
    policy->built(60);
    policy->frame_done({.refit = 0.1, .trace = 10});
    policy->review({.cost_ratio = 200});
    EXPECT_EQ(policy->review({.cost_ratio = 200, .restructured = true}).step, UpdateStep::kRebuild);
    policy->frame_done({.refit = 0.1, .restructure = 1, .trace = 10, .cost_ratio = 190});
    EXPECT_NE(policy->review({.cost_ratio = 200}).step, UpdateStep::kRebuild);
}

TEST(AutoPolicy, NoFrameIsAQuarterSlowerThanSoundWhateverThatCosts) {
    Clip clip;
    clip.build = 7;
    EXPECT_LE(play("auto", clip, 200).worst_slowdown, 1.25);
    // Over the budget, so the build starts early enough.
    clip.build = 30;
    clip.ratio = [](int age) { return 1 + 0.15 * age; };
    EXPECT_LE(play("auto", clip, 200).worst_slowdown, 1.25);
    clip.cure = 1;
    clip.restructure = 9;
    EXPECT_LE(play("auto", clip, 200).worst_slowdown, 1.25);
}

TEST(AutoPolicy, TreesThatAreTooLateWhenTheyAreTakenDoNotBegetOthers) {
    const auto policy = make_update_policy("auto");
    policy->built(1e6);
    policy->frame_done({.refit = 0.1, .trace = 10, .cost_ratio = 4, .new_tree = true});
    for (int frame = 0; frame < 100; ++frame) {
        const UpdateDecision decision =
            policy->review({.cost_ratio = 4, .restructured = frame % 2 == 0});
        ASSERT_NE(decision.step, UpdateStep::kRebuildInBackground) << frame;
        policy->frame_done({.refit = 0.1, .trace = 10, .cost_ratio = 4});
    }
}

TEST(AutoPolicy, TreeOfACollapsedSceneIsRebuiltWhenItUnfolds) {
    const auto policy = make_update_policy("auto");
    policy->built(50);
    const double infinity = std::numeric_limits<double>::infinity();
    EXPECT_EQ(policy->review({infinity, false}).step, UpdateStep::kRebuild);
}

TEST(AutoPolicy, BuildOverTheBudgetGoesOnBehind) {
    for (const UpdateConfig& config :
         {UpdateConfig{.budget = 0.25}, UpdateConfig{.budget = 100, .budget_ms = 2.5}}) {
        const auto policy = make_update_policy("auto", config);
        policy->built(20);
        UpdateDecision decision;
        for (int frame = 0; frame < 100 && decision.step == UpdateStep::kRefit; ++frame) {
            decision = policy->review({.cost_ratio = 1.5});
            if (decision.step == UpdateStep::kRestructure)
                decision = policy->review({.cost_ratio = 1.5, .restructured = true});
            policy->frame_done({.refit = 0.1, .trace = 9.9, .cost_ratio = 1.5});
        }
        EXPECT_EQ(decision.step, UpdateStep::kRebuildInBackground);
        EXPECT_EQ(decision.build_frames, 8u);  // 20 ms, 2.5 ms a frame
    }
}

TEST(AutoPolicy, WhileABuildIsPendingNoOtherIsBegun) {
    const auto policy = make_update_policy("auto");
    policy->built(20);
    for (int frame = 0; frame < 100; ++frame) {
        const UpdateDecision decision =
            policy->review({.cost_ratio = 1.5, .build_pending = true, .restructured = true});
        ASSERT_EQ(decision.step, UpdateStep::kRefit) << frame;
        policy->frame_done({.refit = 0.1, .trace = 10, .cost_ratio = 1.5, .build_pending = true});
    }
}

TEST(SlowdownModel, FindsTheExponentOfItsObservations) {
    SlowdownModel model(0.3);
    for (int i = 0; i < 30; ++i) model.learn(4, 2, 1, 1);
    EXPECT_NEAR(model.exponent(), 0.5, 0.03);
    EXPECT_NEAR(model.slowdown(16), 4, 0.5);
}

TEST(SlowdownModel, SoundTreeHasNoneAndAHopelessOneNoEnd) {
    const SlowdownModel model(0.3);
    EXPECT_EQ(model.slowdown(1), 1);
    EXPECT_EQ(model.slowdown(0.3), 1);
    EXPECT_EQ(model.slowdown(0), 1);
    EXPECT_TRUE(std::isinf(model.slowdown(std::numeric_limits<double>::infinity())));
}

TEST(SlowdownModel, WhatSaysNothingTeachesNothing) {
    SlowdownModel model(0.3);
    const double before = model.exponent();
    const double infinity = std::numeric_limits<double>::infinity();
    model.learn(1, 5, 1, 1);
    model.learn(1, 5, 2, 1);
    model.learn(infinity, 5, 1, 1);
    model.learn(2, 0, 1, 1);
    model.learn(2, 5, 1, 0);
    model.learn(2, 5, 0, 1);
    EXPECT_EQ(model.exponent(), before);
}

TEST(SlowdownModel, WatchedFramesDrawTheGuessButNeverToNothing) {
    SlowdownModel idle(0.3);
    SlowdownModel slow(0.3);
    const double guess = idle.exponent();
    for (const double ratio : {1.0, 2.0, 4.0, 8.0}) {
        idle.watch(ratio, 10);
        slow.watch(ratio, 10 * ratio);
    }
    EXPECT_LT(idle.exponent(), 0.5 * guess);
    EXPECT_GT(idle.exponent(), 0);
    EXPECT_GT(slow.exponent(), 2 * guess);
}

TEST(SlowdownModel, StaysWithinReasonWhateverClocksSay) {
    SlowdownModel model(0.3);
    for (int i = 0; i < 50; ++i) model.learn(1.2, 1e6, 1, 1e-6);
    EXPECT_LE(model.exponent(), 1.25);
    for (int i = 0; i < 50; ++i) model.learn(1.2, 1e-6, 1, 1e6);
    EXPECT_GE(model.exponent(), 0);
}

}  // namespace
}  // namespace mray
