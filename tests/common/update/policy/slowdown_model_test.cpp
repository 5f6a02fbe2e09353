// The model learns from replaced trees, and never beyond reason.
#include "common/update/policy/slowdown_model.h"

#include <gtest/gtest.h>

namespace mray {
namespace {

TEST(SlowdownModel, FindsTheFactorOfItsObservations) {
    SlowdownModel model(0.001);
    // 1 + 0.002 * 1000 against 1 + 0.002 * 100.
    for (int i = 0; i < 30; ++i) model.learn(1000, 3, 100, 1.2);
    EXPECT_NEAR(model.per_visit(), 0.002, 0.0001);
    EXPECT_NEAR(model.slowdown(2000), 5, 0.2);
}

TEST(SlowdownModel, WatchedFramesDrawTheGuessButNeverToNothing) {
    SlowdownModel idle(0.001);
    SlowdownModel slow(0.001);
    for (const double excess : {0.0, 100.0, 200.0, 400.0}) {
        idle.watch(excess, 10);
        slow.watch(excess, 10 * (1 + 0.005 * excess));
    }
    EXPECT_LT(idle.per_visit(), 0.0005);
    EXPECT_GT(idle.per_visit(), 0);
    EXPECT_GT(slow.per_visit(), 0.002);
}

TEST(SlowdownModel, StaysWithinReasonWhateverClocksSay) {
    SlowdownModel model(0.001);
    for (int i = 0; i < 50; ++i) model.learn(120, 1e6, 0, 1e-6);
    EXPECT_LE(model.per_visit(), 0.02);
    for (int i = 0; i < 50; ++i) model.learn(120, 1e-6, 0, 1e6);
    EXPECT_GE(model.per_visit(), 0);
}

}  // namespace
}  // namespace mray
