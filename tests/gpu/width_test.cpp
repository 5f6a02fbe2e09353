// Lavapipe's vectors are 4, 8 or 16 lanes wide and its threads any number, set by the environment;
// ctest runs this program under several of them. The answer is the CPU's in each.
#include <gtest/gtest.h>

#include <cstdio>

#include "common/bvh_builder.h"
#include "cpu/cpu_backend.h"
#include "gpu/vulkan_backend.h"
#include "tests/gpu/test_scenes.h"

namespace morphray::test {
namespace {

TEST(VectorWidth, DoesNotChangeThePicture) {
    const std::unique_ptr<Backend> vulkan = gpu::make_vulkan_backend();
    const std::unique_ptr<Backend> cpu = cpu::make_scalar_backend();
    std::printf("%s\n", vulkan->description().c_str());
    for (const TestScene& scene : {torus(96, 48), debris(5000, 3)}) {
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
}  // namespace morphray::test
