// On the device, the image of a clip does not depend on the updates of its tree.
#include <gtest/gtest.h>

#include "cpu/cpu_backend.h"
#include "tests/gpu/validated_device.h"
#include "tests/support/motion_checks.h"

namespace mray::test {
namespace {

TEST(HardMotionOnVulkan, GivesTheHitsOfBruteForceUnderEveryPolicy) {
    const auto vulkan = validated_device();
    const auto brute = cpu::make_brute_backend();
    for (const Motion& motion : hard_motions()) expect_hits_of_brute_force(motion, *vulkan, *brute);
}

TEST(HardMotionOnVulkan, TakesTheDecisionsOfTheCpu) {
    const auto vulkan = validated_device();
    const auto cpu = cpu::make_cpu_backend();
    for (const Motion& motion : hard_motions())
        EXPECT_EQ(counted_decisions(motion, *vulkan), counted_decisions(motion, *cpu));
}

TEST(HardMotionOnVulkan, LeavesTheBytesOfAFreshRefit) {
    const auto vulkan = validated_device();
    for (const Motion& motion : hard_motions()) expect_no_drift(motion, *vulkan);
}

}  // namespace
}  // namespace mray::test
