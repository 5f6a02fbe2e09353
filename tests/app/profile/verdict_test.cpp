// Verdicts on made times: each stage takes 1 ms and a little more, in a pattern that is the noise.
#include <gtest/gtest.h>

#include "app/commands/profile/baseline.h"
#include "app/report/profile_table.h"

namespace mray::test {
namespace {

using app::BaselineReport;
using app::ProfileReport;
using app::StageVerdict;

/// `runs` times from 1 to 1 + noise, evenly apart, in an order that `seed` shifts.
std::vector<double> made_times(int runs, double noise, int seed) {
    std::vector<double> times;
    for (int i = 0; i < runs; ++i)
        times.push_back(1 + noise * ((i * 3 + seed) % runs) / std::max(1, runs - 1));
    return times;
}

ProfileReport made_report(int runs = 5, double noise = 0.02, int seed = 0) {
    ProfileReport report;
    report.version = "1.2.3";
    for (const char* backend : {"cpu", "vulkan"}) {
        for (const double frame : {0.0, 6.0, 12.0, 24.0}) {
            app::ProfileRow& row = report.rows.emplace_back();
            row.frame = frame;
            row.backend = backend;
            for (const app::SampleKind& kind : app::kSampleKinds)
                row.samples.*kind.samples = made_times(runs, noise, seed);
        }
    }
    return report;
}

/// Makes a stage of a backend `factor` times as long at all frames, or at one.
void slow_down(ProfileReport& report, const std::string& backend,
               std::vector<double> app::StageSamples::*stage, double factor, double frame = -1) {
    for (app::ProfileRow& row : report.rows) {
        if (row.backend != backend || (frame >= 0 && row.frame != frame)) continue;
        for (double& ms : row.samples.*stage) ms *= factor;
    }
}

BaselineReport compare(const ProfileReport& then, const ProfileReport& now, double tolerance = 5) {
    return app::compare_with_baseline("b.json", then, now, tolerance);
}

const app::StageChange& stage_of(const BaselineReport& report, const std::string& backend,
                                 const std::string& stage) {
    for (const app::StageChange& change : report.stages)
        if (change.backend == backend && change.stage == stage) return change;
    throw std::out_of_range(stage);
}

bool has(const BaselineReport& report, const std::string& part) {
    return app::baseline_text(report).find(part) != std::string::npos;
}

TEST(Verdict, OfTheSameProgramIsOkForAllStages) {
    const BaselineReport report = compare(made_report(), made_report(5, 0.02, 1));
    ASSERT_EQ(report.stages.size(), 8u);
    EXPECT_EQ(report.count(StageVerdict::kSame), 8u) << app::baseline_text(report);
    EXPECT_EQ(report.load_factor, 1);
    EXPECT_TRUE(
        has(report, "none of 8 stages more than 5% slower than in b.json (morphray 1.2.3)"));
}

TEST(Verdict, FindsTenPercentInOneStage) {
    ProfileReport now = made_report(5, 0.02, 1);
    slow_down(now, "vulkan", &app::StageSamples::trace, 1.1);
    const BaselineReport report = compare(made_report(), now);
    const app::StageChange& trace = stage_of(report, "vulkan", "trace");
    EXPECT_EQ(trace.verdict, StageVerdict::kSlower);
    EXPECT_NEAR(trace.percent(), 10, 1e-9);
    EXPECT_GT(trace.ratio.least, 1.05);
    EXPECT_LT(trace.ratio.most, 1.15);
    // All of 5 times after are above all of 5 before, at 4 frames: 1 in 252^4, and 8 stages.
    EXPECT_NEAR(trace.chance, 8 / (252.0 * 252 * 252 * 252), 1e-15);
    EXPECT_EQ(report.count(StageVerdict::kSlower), 1u);
    EXPECT_EQ(report.count(StageVerdict::kSame), 7u) << app::baseline_text(report);
    const BaselineReport reverse = compare(now, made_report());
    EXPECT_EQ(stage_of(reverse, "vulkan", "trace").verdict, StageVerdict::kFaster);
    EXPECT_EQ(reverse.count(StageVerdict::kSlower), 0u);
}

TEST(Verdict, ShowsTimesOfItsRatioForAnyNumberOfFrames) {
    ProfileReport then = made_report();
    ProfileReport now = made_report();
    for (const double frame : {0.0, 6.0, 12.0, 24.0}) {
        slow_down(then, "cpu", &app::StageSamples::trace, 1 + frame, frame);
        slow_down(now, "cpu", &app::StageSamples::trace, (1 + frame) * (1 + frame), frame);
    }
    for (int frames = 4; frames > 1; --frames) {
        const BaselineReport report = compare(then, now);
        const app::StageChange& trace = stage_of(report, "cpu", "trace");
        EXPECT_NEAR(trace.measured_ms / trace.expected_ms, trace.ratio.ratio, 1e-9) << frames;
        for (ProfileReport* side : {&then, &now}) {
            const double last = side->rows.back().frame;
            std::erase_if(side->rows,
                          [&](const app::ProfileRow& row) { return row.frame == last; });
        }
    }
}

TEST(Verdict, IsOkForLessThanTheTolerance) {
    ProfileReport now = made_report();
    slow_down(now, "cpu", &app::StageSamples::rebuild, 1.1);
    EXPECT_EQ(compare(made_report(), now, 20).count(StageVerdict::kSame), 8u);
    EXPECT_EQ(stage_of(compare(made_report(), now, 10.5), "cpu", "rebuild").verdict,
              StageVerdict::kUnsure);
}

TEST(Verdict, NeedsMoreThanTheNoise) {
    ProfileReport now = made_report(5, 0.5, 1);
    slow_down(now, "cpu", &app::StageSamples::trace, 1.1);
    const BaselineReport noisy = compare(made_report(5, 0.5), now);
    EXPECT_EQ(noisy.count(StageVerdict::kSlower), 0u);
    EXPECT_EQ(stage_of(noisy, "cpu", "trace").verdict, StageVerdict::kUnsure);
    EXPECT_TRUE(has(noisy, "the noise of the runs hides changes of 5%"));
    EXPECT_TRUE(has(noisy, "more runs tell more"));
    slow_down(now, "cpu", &app::StageSamples::trace, 3);
    EXPECT_EQ(stage_of(compare(made_report(5, 0.5), now), "cpu", "trace").verdict,
              StageVerdict::kSlower);
}

TEST(Verdict, OnABusyMachineNeedsMoreThanItsLoadExplains) {
    ProfileReport now = made_report();
    now.others = 0.5;
    slow_down(now, "cpu", &app::StageSamples::trace, 3.9);
    slow_down(now, "cpu", &app::StageSamples::rebuild, 4.2);
    const BaselineReport report = compare(made_report(), now);
    EXPECT_EQ(report.load_factor, 4);
    EXPECT_EQ(stage_of(report, "cpu", "trace").verdict, StageVerdict::kUnsure);
    EXPECT_EQ(stage_of(report, "cpu", "rebuild").verdict, StageVerdict::kSlower);
    EXPECT_EQ(report.count(StageVerdict::kUnsure), 7u);
    EXPECT_TRUE(has(report, "the machine was busy, which may change times by a factor of 4.0"));
    // It may have been the baseline's machine that was busy; threads that waited tell the same.
    ProfileReport waited = made_report();
    waited.waited = 0.5;
    EXPECT_EQ(compare(waited, made_report()).load_factor, 4);
    EXPECT_EQ(compare(waited, made_report()).count(StageVerdict::kUnsure), 8u);
}

/// A report of the first frame alone.
ProfileReport of_one_frame(ProfileReport report) {
    std::erase_if(report.rows, [](const app::ProfileRow& row) { return row.frame != 0; });
    return report;
}

TEST(Verdict, NeedsEnoughRuns) {
    ProfileReport now = made_report(1);
    slow_down(now, "cpu", &app::StageSamples::trace, 100);
    const BaselineReport report = compare(made_report(1), now);
    EXPECT_EQ(report.count(StageVerdict::kSlower), 0u);
    EXPECT_TRUE(report.has_too_few_runs);
    // 8 stages: 1 in 2^4 times for one run of each of 4 frames, 1 in 6^4 times for two.
    EXPECT_TRUE(
        has(report,
            "\n--repeat 1 is too few to call a stage slower; 2 or more are needed, here and "
            "in the baseline\n"));
    EXPECT_FALSE(has(report, "more runs tell more"));
    EXPECT_FALSE(compare(made_report(3), made_report(3)).has_too_few_runs);
}

TEST(Verdict, SaysTheLeastNumberOfRunsWithWhichItIsPossible) {
    for (const bool one_frame : {true, false}) {
        const auto made = [&](int runs) {
            return one_frame ? of_one_frame(made_report(runs)) : made_report(runs);
        };
        const std::size_t least = compare(made(1), made(1)).least_runs;
        EXPECT_EQ(least, one_frame ? 6u : 2u);
        for (int runs = 1; runs < 12; ++runs) {
            ProfileReport now = made(runs);
            slow_down(now, "cpu", &app::StageSamples::trace, 100);
            const BaselineReport report = compare(made(runs), now);
            const bool is_enough = static_cast<std::size_t>(runs) >= least;
            EXPECT_EQ(report.least_runs, least);
            EXPECT_EQ(report.count(StageVerdict::kSlower), is_enough ? 1u : 0u) << runs;
            EXPECT_EQ(has(report, "too few to call a stage slower"), !is_enough) << runs;
        }
    }
}

TEST(Verdict, SaysThatTheBaselineHasTooFewRuns) {
    const BaselineReport report =
        compare(of_one_frame(made_report(2)), of_one_frame(made_report(20)));
    EXPECT_TRUE(has(report,
                    "\n--repeat 2 of the baseline is too few to call a stage slower; 6 or more are "
                    "needed\n"));
    // Many runs make up for few.
    EXPECT_FALSE(
        compare(of_one_frame(made_report(4)), of_one_frame(made_report(20))).has_too_few_runs);
}

TEST(Verdict, FindsTenPercentInTenRunsOfOneFrame) {
    // The middle half of the times is 2.4 % apart.
    ProfileReport now = of_one_frame(made_report(10, 0.048, 1));
    slow_down(now, "cpu", &app::StageSamples::trace, 1.1);
    const BaselineReport report = compare(of_one_frame(made_report(10, 0.048)), now);
    EXPECT_EQ(stage_of(report, "cpu", "trace").verdict, StageVerdict::kSlower)
        << app::baseline_text(report);
    EXPECT_EQ(report.count(StageVerdict::kSlower), 1u);
}

TEST(Verdict, IsThatOfTheFrameInTheMiddleAndNamesTheWorst) {
    ProfileReport now = made_report();
    slow_down(now, "cpu", &app::StageSamples::trace, 3, 12);
    const BaselineReport report = compare(made_report(), now);
    const app::StageChange& trace = stage_of(report, "cpu", "trace");
    EXPECT_NE(trace.verdict, StageVerdict::kSlower);
    EXPECT_NEAR(trace.percent(), 0, 1e-9);
    EXPECT_EQ(trace.worst_frame, 12);
    EXPECT_NEAR(trace.worst_percent, 200, 1e-9);
    EXPECT_TRUE(has(report, "12: +200.0"));
}

TEST(Verdict, TimesInUnitsOfTheYardstick) {
    ProfileReport now = made_report();
    for (app::ProfileRow& row : now.rows) {
        for (const app::SampleKind& kind : app::kSampleKinds)
            for (double& ms : row.samples.*kind.samples) ms *= 2;
    }
    const BaselineReport report = compare(made_report(), now);
    EXPECT_EQ(report.count(StageVerdict::kSame), 8u) << app::baseline_text(report);
    EXPECT_NEAR(report.stages[0].expected_ms, 2.02, 1e-9);
    EXPECT_NEAR(report.stages[0].measured_ms, 2.02, 1e-9);
}

TEST(Verdict, IsNoneForTimesThatAreTooShort) {
    ProfileReport then = made_report(), now = made_report();
    for (ProfileReport* report : {&then, &now})
        slow_down(*report, "cpu", &app::StageSamples::update, 0.01);
    slow_down(now, "cpu", &app::StageSamples::update, 1.5);
    EXPECT_EQ(stage_of(compare(then, now), "cpu", "update").verdict, StageVerdict::kTooShort);
}

TEST(Verdict, WithoutSamplesOfTheBaselineTakesTheNoiseOfThisRun) {
    ProfileReport then = made_report();
    then.has_samples = false;
    for (app::ProfileRow& row : then.rows) {
        for (const app::SampleKind& kind : app::kSampleKinds) row.samples.*kind.samples = {1};
    }
    ProfileReport now = made_report();
    EXPECT_EQ(compare(then, now).count(StageVerdict::kSame), 8u);
    slow_down(now, "cpu", &app::StageSamples::trace, 1.1);
    const BaselineReport report = compare(then, now);
    EXPECT_EQ(report.count(StageVerdict::kSlower), 1u);
    EXPECT_NEAR(stage_of(report, "cpu", "trace").percent(), 10, 1e-9);
    EXPECT_TRUE(has(report, "the baseline has no samples"));
}

}  // namespace
}  // namespace mray::test
