// Kernels are compiled when a call first needs them, each once.
#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tests/gpu/faulty_loader.h"
#include "tests/gpu/test_scenes.h"
#include "tests/support/backend_results.h"
#include "tests/support/run_together.h"
#include "tests/support/thrown_error.h"

namespace mray::test {
namespace {

/// A backend over a scene, and the number of pipelines that it makes.
struct CountedDevice {
    explicit CountedDevice(std::uint32_t step_budget = kStepBudget)
        : device({.step_budget = step_budget}) {
        faults.counts = [](std::string_view name) { return name == "vkCreateComputePipelines"; };
        compiled = 0;
        set_scene(backend, scene, built_tree(scene));
    }

    void trace_image(std::uint32_t rays) {
        Frame frame;
        backend.trace_image(view(16, 16, rays), frame);
    }
    void trace_rays() {
        std::vector<Hit> hits(64);
        backend.trace({mixed_rays(scene, hits.size(), 1), hits});
    }

    FaultyDevice device;
    Faults& faults = device.faults;
    Backend& backend = *device.backend;
    std::size_t& compiled = faults.call_count;
    const TestScene scene = torus(12, 8);
};

TEST(Kernels, AreCompiledWhenACallFirstNeedsThem) {
    CountedDevice device;
    EXPECT_EQ(device.compiled, 0u);
    for (int i = 0; i < 2; ++i) {
        device.trace_image(kRaysPrimary);
        EXPECT_EQ(device.compiled, 5u) << "leaves, nodes, camera rays, open triangles, shading";
    }
    for (const std::uint32_t rays : {kRaysShadow, kRaysAo}) {
        device.trace_image(rays);
        EXPECT_EQ(device.compiled, 7u) << "and visible pixels, occlusion";
    }
    MovingScene moving(device.backend, device.scene, built_tree(device.scene));
    for (const float time : {1.0f, 2.0f}) {
        moving.refit(swayed(device.scene, time));
        EXPECT_EQ(device.compiled, 7u);
    }
    device.trace_rays();
    device.trace_image(kRaysShadow);
    EXPECT_EQ(device.compiled, 9u) << "and rays, and those that continue, as at vertices";
}

TEST(Kernels, ThatContinueRaysAreCompiledForRaysThatNeedThem) {
    CountedDevice device(20);
    device.trace_rays();
    EXPECT_EQ(device.compiled, 5u) << "leaves, nodes, rays, open triangles, and rays that continue";
}

TEST(Kernels, ThatFailToCompileAreCompiledByTheNextCall) {
    const ImageParams params = view(32, 32, kRaysAo);
    const ImageHashes expected = [&] {
        CountedDevice device;
        return image_hashes(device.backend, params);
    }();
    // Each kernel, and the submission that dispatches it for the first time.
    for (const char* const call : {"vkCreateComputePipelines", "vkQueueSubmit"}) {
        for (std::size_t k = 0; k < 7; ++k) {
            SCOPED_TRACE(testing::Message() << call << " " << k);
            CountedDevice device;
            Faults& faults = device.faults;
            faults.counts = [call](std::string_view name) { return name == call; };
            faults.result = VK_ERROR_OUT_OF_HOST_MEMORY;
            faults.fail_at = faults.call_count + k;
            EXPECT_EQ(kind_of([&] { device.trace_image(kRaysAo); }), ErrorKind::kLimit);
            EXPECT_EQ(faults.failed_name, call);
            EXPECT_EQ(image_hashes(device.backend, params), expected);
        }
    }
}

TEST(SharedDevice, ServesManyScenesThatCostTheirBuffersOnly) {
    std::map<std::string, int, std::less<>> calls;
    Faults faults;
    faults.counts = [&](std::string_view name) {
        ++calls[std::string(name)];
        return false;
    };
    const FaultyLoader loader(faults);
    gpu::Tuning tuning;
    tuning.loader = loader.get();
    const std::shared_ptr<gpu::SharedDevice> shared = gpu::open_device({}, tuning);
    const TestScene scene = torus(12, 8);
    const Bvh bvh = built_tree(scene);
    constexpr int kBackends = 200;
    std::vector<std::unique_ptr<Backend>> backends;
    std::optional<ImageHashes> expected;
    for (int i = 0; i < kBackends; ++i) {
        Backend& backend = *backends.emplace_back(gpu::make_backend_on(shared, tuning));
        set_scene(backend, scene, bvh);
        const ImageHashes hashes = image_hashes(backend, view(16, 16, kRaysShadow));
        if (!expected) expected = hashes;
        EXPECT_EQ(hashes, *expected);
    }
    EXPECT_EQ(calls["vkCreateInstance"], 1);
    EXPECT_EQ(calls["vkCreateDevice"], 1);
    EXPECT_EQ(calls["vkCreateComputePipelines"], 7);
    EXPECT_LT(calls["vkAllocateMemory"], 20);
}

TEST(SharedDevice, IsMadeAnewAfterItWasLost) {
    const std::shared_ptr<gpu::SharedDevice> first = gpu::open_device({});
    EXPECT_EQ(gpu::open_device({}), first);
    first->device.set_lost();
    const std::shared_ptr<gpu::SharedDevice> second = gpu::open_device({});
    EXPECT_NE(second, first);
    EXPECT_EQ(gpu::open_device({}), second);
    // A validated one is the caller's alone.
    EXPECT_NE(gpu::open_device({.device = "", .validate = true}), second);
}

TEST(Kernels, OfSeveralBackendsAreCompiledAtTheSameTime) {
    const TestScene scene = torus(12, 8);
    const Bvh bvh = built_tree(scene);
    constexpr std::size_t kBackends = 4;
    std::vector<std::unique_ptr<Backend>> backends;
    for (std::size_t i = 0; i < kBackends; ++i) {
        backends.push_back(gpu::make_vulkan_backend());
        set_scene(*backends[i], scene, bvh);
    }
    std::vector<ImageHashes> hashes(kBackends);
    run_together(kBackends, [&](std::size_t i) {
        hashes[i] = image_hashes(*backends[i], view(32, 32, kRaysAo));
    });
    for (const ImageHashes& h : hashes) EXPECT_EQ(h, hashes[0]);
}

}  // namespace
}  // namespace mray::test
