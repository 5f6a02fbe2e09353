// Signals at random times: reports and images are written or absent, never torn, and the next run
// leaves nothing of one that was killed.
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <cstdlib>
#include <random>
#include <thread>

#include "tests/faults/works.h"

namespace mray::test {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kSignals[] = {SIGINT, SIGTERM, SIGHUP, SIGPIPE, SIGKILL};

/// Sends each signal in turn, at times up to a little after the end of a run.
void expect_no_torn_file(const Work& work) {
    TemporaryFolder undisturbed;
    write_inputs(undisturbed);
    const Clock::time_point start = Clock::now();
    const Outcome outcome = run(work.arguments, {.folder = undisturbed.path()});
    const Clock::duration length = Clock::now() - start;
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    const Outputs complete = outputs_of(undisturbed);
    std::mt19937 random(1);
    std::uniform_real_distribution<double> part(0.0, 1.1);
    const int rounds = std::getenv("MORPHRAY_EVERY_FAULT") != nullptr ? 25 : 1;
    for (int i = 0; i < rounds; ++i) {
        for (const int signal : kSignals) {
            const auto delay = std::chrono::duration_cast<Clock::duration>(length * part(random));
            SCOPED_TRACE(std::string(work.name) + ", signal " + std::to_string(signal) + " after " +
                         std::to_string(std::chrono::duration<double>(delay).count()) + " s");
            TemporaryFolder folder;
            write_inputs(folder);
            Started started(work.arguments, {.folder = folder.path()});
            std::this_thread::sleep_for(delay);
            started.send(signal);
            const Outcome ended = started.wait();
            EXPECT_TRUE(ended.code == 0 || ended.code == 128 + signal)
                << ended.code << ": " << ended.err;
            EXPECT_LE(lines(ended.err).size(), 1u) << ended.err;
            if (signal != SIGKILL) {
                expect_whole(outputs_of(folder), complete);
                continue;
            }
            EXPECT_EQ(run(work.arguments, {.folder = folder.path()}).code, 0);
            const Outputs repeated = outputs_of(folder);
            EXPECT_EQ(repeated.size(), complete.size());
            expect_whole(repeated, complete);
        }
    }
}

class SignalsAtAnyTime : public ::testing::TestWithParam<Work> {};

TEST_P(SignalsAtAnyTime, LeaveNoTornFile) { expect_no_torn_file(GetParam()); }

INSTANTIATE_TEST_SUITE_P(Cpu, SignalsAtAnyTime, ::testing::ValuesIn(works("cpu")),
                         [](const auto& work) { return std::string(work.param.name); });
#ifdef FAULT_LAYER_FOLDER
INSTANTIATE_TEST_SUITE_P(Vulkan, SignalsAtAnyTime, ::testing::ValuesIn(works("vulkan")),
                         [](const auto& work) { return std::string(work.param.name); });
#endif

}  // namespace
}  // namespace mray::test
