// Lavapipe gives the answers of the CPU with vectors of 4, 8 and 16 lanes, or is refused with those
// that it does not serve, and with any number of threads. ctest runs this program with several
// environments that set them.
#include <gtest/gtest.h>

#include <string>

#include "common/base/errors.h"
#include "cpu/cpu_backend.h"
#include "gpu/vulkan_backend.h"
#include "tests/gpu/test_scenes.h"
#include "tests/support/backend_results.h"

namespace mray::test {
namespace {

/// Whether this lavapipe is refused with the width of the environment, as newer ones are with all
/// but 256.
bool is_refused() {
    const gpu::DeviceInfo device = gpu::list_devices().front();
    if (device.unusable.empty()) return false;
    EXPECT_NE(device.unusable.find("LP_NATIVE_VECTOR_WIDTH"), std::string::npos) << device.unusable;
    EXPECT_EQ(device.driver.find("Mesa 22."), std::string::npos) << device.driver;
    EXPECT_NE(device.subgroup_size, 8u);
    EXPECT_THROW(gpu::make_vulkan_backend(), Error);
    return true;
}

TEST(VectorWidth, DoesNotChangeTheImage) {
    if (is_refused()) return;
    const std::unique_ptr<Backend> vulkan = gpu::make_vulkan_backend();
    const std::unique_ptr<Backend> cpu = cpu::make_scalar_backend();
    for (const TestScene& scene : {torus(96, 48), random_soup(5000, 0.1, 3)}) {
        MovingScene on_vulkan(*vulkan, scene, built_tree(scene));
        MovingScene on_cpu(*cpu, scene, built_tree(scene));
        for (MovingScene* moving : {&on_vulkan, &on_cpu}) moving->refit(swayed(scene, 2));
        for (const std::uint32_t rays : {kRaysPrimary, kRaysShadow, kRaysAo})
            EXPECT_EQ(image_hashes(*vulkan, view(160, 120, rays)),
                      image_hashes(*cpu, view(160, 120, rays)));
    }
}

}  // namespace
}  // namespace mray::test
