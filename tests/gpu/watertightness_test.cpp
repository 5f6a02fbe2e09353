// Surfaces stay closed on the device.
#include <gtest/gtest.h>

#include "common/bvh/builder/bvh_builder.h"
#include "tests/gpu/validated_device.h"
#include "tests/support/motions.h"

namespace mray::test {
namespace {

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
