// The line of progress; its thread is tested with a terminal (live_line_test.cpp).
#include "app/terminal/progress.h"

#include <gtest/gtest.h>

namespace mray::app {
namespace {

ProgressState state_of(std::uint64_t done, std::uint64_t total, double elapsed_s) {
    return {.label = "rendering", .done = done, .total = total, .elapsed_s = elapsed_s};
}

TEST(ProgressLine, ShowsUnitsStepAndTimeLeft) {
    ProgressState state = state_of(5, 10, 4);
    state.step = "frame 12";
    EXPECT_EQ(progress_line(state, 100),
              "rendering [##########..........] 5/10  frame 12  4 s left");
    EXPECT_EQ(progress_line(state, 20), "rendering [#########");
}

TEST(ProgressLine, CountsThePartOfAUnit) {
    ProgressState state = state_of(1, 4, 30);
    state.part = 0.5f;
    EXPECT_EQ(progress_line(state, 100), "rendering [#####...............] 1/4  2 min left");
    state.counts_part = true;
    EXPECT_EQ(progress_line(state, 100), "rendering [#######.............] 1/4  50 s left");
}

TEST(ProgressLine, HasNoTimeBeforeAnythingIsDone) {
    EXPECT_EQ(progress_line(state_of(0, 10, 100), 100), "rendering [....................] 0/10");
    EXPECT_EQ(progress_line(state_of(0, 0, 100), 100), "rendering [....................] 0 %");
}

}  // namespace
}  // namespace mray::app
