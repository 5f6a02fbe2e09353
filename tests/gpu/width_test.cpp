// Lavapipe gives the answers of the CPU with vectors of 4, 8 and 16 lanes, or is refused with those
// that it does not serve, and with any number of threads. ctest runs this program with several
// environments that set them.
#include <gtest/gtest.h>

#include <cstdio>
#include <string>

#include "common/base/errors.h"
#include "common/bvh/builder/bvh_builder.h"
#include "cpu/cpu_backend.h"
#include "gpu/vulkan_backend.h"
#include "tests/gpu/test_scenes.h"

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
    std::printf("%s\n", vulkan->info().description.c_str());
    for (const DeviceScene& scene : {torus(96, 48), debris(5000, 3)}) {
        const Bvh bvh = build_bvh(scene.topology, scene.positions);
        const std::vector<vec3> positions = swayed(scene, 2);
        for (Backend* backend : {vulkan.get(), cpu.get()}) {
            backend->set_scene(scene.topology, scene.positions, bvh);
            backend->refit(positions);
        }
        for (const std::uint32_t rays : {kRaysPrimary, kRaysShadow, kRaysAo}) {
            Frame expected, actual;
            cpu->trace_image(view(160, 120, rays), expected);
            vulkan->trace_image(view(160, 120, rays), actual);
            std::printf("%s, rays %u: hits %016llx image %016llx\n", scene.name, rays,
                        static_cast<unsigned long long>(hits_hash(actual)),
                        static_cast<unsigned long long>(image_hash(actual)));
            EXPECT_EQ(hits_hash(actual), hits_hash(expected));
            EXPECT_EQ(image_hash(actual), image_hash(expected));
        }
    }
}

}  // namespace
}  // namespace mray::test
