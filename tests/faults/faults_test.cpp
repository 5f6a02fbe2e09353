// What goes wrong around the program: allocations fail, and it is killed while it writes. Files
// that are there are whole.
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <thread>

#include "tests/faults/whole_files.h"

namespace mray::test {
namespace {

TEST(Faults, AFailingAllocationIsALimit) {
    const Outputs complete = outputs_of_a_run();
    bool is_any = false;
    for (int allocation = 0; allocation < 40'000; allocation += 997) {
        SCOPED_TRACE(allocation);
        const TemporaryFolder folder;
        const Outcome outcome = run(
            kWork, {.environment = {"LD_PRELOAD=" FAILING_ALLOCATION,
                                    "MORPHRAY_FAILING_ALLOCATION=" + std::to_string(allocation)},
                    .folder = folder.path()});
        // Constructors of libraries, before main, end the process by abort() if memory runs out.
        EXPECT_TRUE(outcome.code == 0 || outcome.code == 6 || outcome.code == 134)
            << outcome.code << ": " << outcome.err;
        is_any = is_any || outcome.code == 6;
        expect_whole(outputs_of(folder), complete);
    }
    EXPECT_TRUE(is_any);
}

TEST(Faults, AKilledProgramLeavesNoTornFileAndTheNextRunIsWhole) {
    const auto start = std::chrono::steady_clock::now();
    const Outputs complete = outputs_of_a_run();
    const auto length = std::chrono::steady_clock::now() - start;
    for (int part = 1; part < 10; ++part) {
        const TemporaryFolder folder;
        Started started(kWork, {.folder = folder.path()});
        std::this_thread::sleep_for(length * part / 10);
        started.send(SIGKILL);
        started.wait();
        EXPECT_EQ(run(kWork, {.folder = folder.path()}).code, 0);
        EXPECT_EQ(outputs_of(folder), complete);
    }
}

}  // namespace
}  // namespace mray::test
