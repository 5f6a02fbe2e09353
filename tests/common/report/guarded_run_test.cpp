// Work in a process of its own.
#include "common/report/guarded_run.h"

#include <gtest/gtest.h>
#include <signal.h>

#include <stdexcept>

namespace mray::test {
namespace {

TEST(GuardedRun, SharesOnlyWritesToSharedMemory) {
    const SharedMemory memory(2 * sizeof(int));
    EXPECT_EQ(memory.as<int>(2)[1], 0);
    int own = 1;
    EXPECT_EQ(run_guarded([&] { memory.as<int>(2)[1] = own = 7; }, 60), RunEnd::kDone);
    EXPECT_EQ(memory.as<int>(2)[1], 7);
    EXPECT_EQ(own, 1);
}

TEST(GuardedRun, OutlivesACrashAndAnException) {
    EXPECT_EQ(run_guarded([] { raise(SIGKILL); }, 60), RunEnd::kCrashed);
    EXPECT_EQ(run_guarded([] { throw std::runtime_error("no"); }, 60), RunEnd::kCrashed);
}

TEST(GuardedRun, EndsWorkThatDoesNotEnd) {
    EXPECT_EQ(run_guarded(
                  [] {
                      for (volatile bool forever = true; forever;) {
                      }
                  },
                  1),
              RunEnd::kNoEnd);
}

}  // namespace
}  // namespace mray::test
