#include "common/report/thread_clock.h"

#include <gtest/gtest.h>

#include "common/report/guarded_run.h"

namespace mray::test {
namespace {

// A clock in ticks would show the same time nearly always.
TEST(ThreadClock, AdvancesBetweenReadingsInAProcessWithALimitOfItsTime) {
    constexpr std::size_t kReadings = 1000;
    const SharedMemory memory(kReadings * sizeof(double));
    const auto times = memory.as<double>(kReadings);
    const auto read = [&] {
        for (double& time : times) time = thread_ms();
    };
    ASSERT_EQ(run_guarded(read, 60), RunEnd::kDone);
    std::size_t advances = 0;
    for (std::size_t i = 1; i < kReadings; ++i) {
        EXPECT_GE(times[i], times[i - 1]);
        advances += times[i] > times[i - 1];
    }
    EXPECT_GT(advances, kReadings / 2);
}

}  // namespace
}  // namespace mray::test
