// The image of an animation does not depend on how its tree followed it: the CPU.
#include <gtest/gtest.h>

#include <cctype>
#include <string>

#include "cpu/cpu_backend.h"
#include "tests/support/motion_checks.h"

namespace mray::test {
namespace {

class HardMotion : public testing::TestWithParam<Motion> {};
INSTANTIATE_TEST_SUITE_P(Cpu, HardMotion, testing::ValuesIn(hard_motions()),
                         [](const auto& parameter) {
                             std::string name = parameter.param.name;
                             std::erase_if(name, [](unsigned char c) { return !std::isalnum(c); });
                             return name;
                         });

TEST_P(HardMotion, GivesTheHitsOfBruteForceUnderEveryPolicy) {
    expect_hits_of_brute_force(GetParam(), *cpu::make_cpu_backend(), *cpu::make_brute_backend());
}

TEST_P(HardMotion, TakesTheSameDecisionsOnAnyNumberOfThreads) {
    EXPECT_EQ(counted_decisions(GetParam(), *cpu::make_cpu_backend({.threads = 1})),
              counted_decisions(GetParam(), *cpu::make_cpu_backend({.threads = 3})));
}

TEST_P(HardMotion, LosesAFiniteTimeInEachFrame) {
    for (const std::string& decision : counted_decisions(GetParam(), *cpu::make_cpu_backend())) {
        EXPECT_EQ(decision.find("nan %"), std::string::npos) << decision;
        EXPECT_EQ(decision.find("inf %"), std::string::npos) << decision;
    }
}

}  // namespace
}  // namespace mray::test
