#include "tools/measure/machine_load.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <thread>

#include "common/base/stopwatch.h"

namespace mray {
namespace {

TEST(MachineLoad, IsAPartOfTheTime) {
    const MachineLoad load;
    EXPECT_EQ(load.others(), 0);
    const Stopwatch watch;
    while (watch.ms() < 50) std::this_thread::yield();
    EXPECT_GE(load.others(), 0);
    EXPECT_LE(load.others(), 1);
}

TEST(MachineLoad, SeesAnotherProgram) {
    const pid_t other = fork();
    if (other == 0) {
        const volatile bool ends = false;
        while (!ends) {
        }
    }
    ASSERT_GT(other, 0);
    const MachineLoad load;
    const Stopwatch watch;
    // However busy the machine is, the other program runs at last.
    while (load.others() == 0 && watch.ms() < 60'000)
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    kill(other, SIGKILL);
    waitpid(other, nullptr, 0);
    EXPECT_GT(load.others(), 0);
}

}  // namespace
}  // namespace mray
