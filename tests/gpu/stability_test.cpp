// On the device, the image of an animation does not depend on the updates of its tree, and surfaces
// stay closed.
#include <gtest/gtest.h>

#include "common/bvh/builder/bvh_builder.h"
#include "cpu/cpu_backend.h"
#include "tests/gpu/validated_device.h"
#include "tests/support/motion_checks.h"
#include "tests/support/motions.h"

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

TEST(WatertightOnVulkan, LetsNoRayOutAfterAThousandRefits) {
    const TestScene scene = icosphere(3);
    const auto vulkan = validated_device();
    vulkan->set_scene(scene.topology(), scene.positions(),
                      build_bvh(scene.topology(), scene.positions()));
    Random random(23);
    std::vector<Hit> hits(1000);
    std::size_t leaks = 0;
    for (int pose = 0; pose < 1000; ++pose) {
        const std::vector<vec3> positions = breathing(scene.positions(), random);
        vulkan->refit(positions);
        const std::vector<Ray> rays = rays_from_inside(scene, positions, hits.size(), random);
        vulkan->trace({rays, hits});
        for (const Hit& hit : hits) leaks += hit.prim_id == kNoPrim;
    }
    EXPECT_EQ(leaks, 0u);
}

}  // namespace
}  // namespace mray::test
