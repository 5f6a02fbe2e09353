// What regret is against, from given times.
#include "common/update/policy_runs.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace mray {
namespace {

/// A comparison of the policies "a", "b" ... that took these totals, each in two frames.
PolicyComparison comparison(double best_schedule_ms, const std::vector<double>& totals_ms) {
    PolicyComparison result;
    result.best.total = best_schedule_ms;
    double least = best_schedule_ms;
    for (const double total : totals_ms) {
        PolicyRun& run = result.runs.emplace_back();
        run.policy = std::string(1, static_cast<char>('a' + result.runs.size() - 1));
        run.frames.resize(2);
        for (PolicyFrame& frame : run.frames) frame.times.trace_ms = total / 2;
        least = std::min(least, total);
    }
    for (PolicyRun& run : result.runs) run.best_ms = least;
    return result;
}

TEST(Regret, IsAgainstTheBestScheduleUnlessAPolicyTookLess) {
    EXPECT_EQ(comparison(3, {4, 3, 5}).best_policy(), "");
    EXPECT_EQ(comparison(3, {4, 2, 1, 5}).best_policy(), "c");
}

TEST(Regret, IsNeverNegative) {
    for (const PolicyComparison& given :
         {comparison(3, {4, 3, 5}), comparison(3, {4, 2, 1}), comparison(0, {0, 0})}) {
        for (const PolicyRun& run : given.runs) {
            EXPECT_GE(run.regret(), 0) << run.policy;
            if (run.policy == given.best_policy()) {
                EXPECT_EQ(run.regret(), 0);
            }
        }
    }
}

}  // namespace
}  // namespace mray
