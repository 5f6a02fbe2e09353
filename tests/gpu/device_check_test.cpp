// A device proves itself before it is used: wrong and lost ones are found, and results are kept.
// Scenes of the library on a device that fails.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "common/base/errors.h"
#include "cpu/cpu_backend.h"
#include "gpu/shared_device.h"
#include "gpu/vulkan/pipeline.h"
#include "gpu/vulkan/vulkan_api.h"
#include "library/src/device_impl.h"
#include "morphray/error.hpp"
#include "tests/gpu/faulty_loader.h"
#include "tests/library/scenes.h"

namespace mray::test {
namespace {

constexpr std::uint32_t kAdd = 129;
constexpr std::uint32_t kSubtract = 131;

/// Turns the subtractions of a kernel into sums.
void break_kernel(std::span<std::uint32_t> words) {
    for (const gpu::SpirvInstruction& i : gpu::read_spirv(words)) {
        if (i.opcode != kSubtract) continue;
        std::uint32_t& head = words[static_cast<std::size_t>(i.operands.data() - words.data()) - 1];
        head = (head & 0xFFFF0000u) | kAdd;
    }
}

/// What the self-test says of a device with faults; the text of an error where there is one.
std::string difference(Faults& faults, gpu::BufferKind kind) {
    const FaultyLoader loader(faults);
    const std::unique_ptr<Backend> tested =
        gpu::make_vulkan_backend({}, {.buffer_kind = kind, .loader = loader.get()});
    const std::unique_ptr<Backend> reference = cpu::make_scalar_backend();
    return morphray::detail::find_difference(*tested, *reference);
}

TEST(DeviceCheck, PassesADeviceWithTheBitsOfTheCpu) {
    for (const gpu::BufferKind kind : {gpu::BufferKind::kTexels, gpu::BufferKind::kStorage}) {
        Faults none;
        EXPECT_EQ(difference(none, kind), "");
    }
}

TEST(DeviceCheck, FindsEachWrongKernel) {
    // Two threads compile them, in any order; `compact` subtracts nothing.
    std::vector<std::vector<std::uint32_t>> kernels;
    Faults listing;
    listing.edit_kernel = [&](std::span<std::uint32_t> words) {
        std::vector<std::uint32_t> kernel(words.begin(), words.end());
        if (std::ranges::find(kernels, kernel) == kernels.end())
            kernels.push_back(std::move(kernel));
    };
    EXPECT_EQ(difference(listing, gpu::BufferKind::kTexels), "");
    std::size_t found = 0;
    for (const std::vector<std::uint32_t>& broken : kernels) {
        Faults faults;
        bool changed = false;
        faults.edit_kernel = [&](std::span<std::uint32_t> words) {
            if (!std::ranges::equal(words, broken)) return;
            break_kernel(words);
            changed = !std::ranges::equal(words, broken);
        };
        const std::string text = difference(faults, gpu::BufferKind::kTexels);
        EXPECT_EQ(!text.empty(), changed) << found;
        found += changed;
    }
    EXPECT_GE(found, 4u) << "camera rays, occlusion, shading, refit of leaves";
}

TEST(DeviceCheck, FindsALostDevice) {
    Faults faults;
    faults.counts = [](std::string_view name) { return name == "vkQueueSubmit"; };
    faults.result = VK_ERROR_DEVICE_LOST;
    faults.fail_at = 6;
    faults.keep_failing = true;
    try {
        difference(faults, gpu::BufferKind::kTexels);
        FAIL();
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kDeviceLost);
    }
}

/// Keeps results in a folder of its own.
class KeptCheck : public testing::Test {
protected:
    KeptCheck() {
        std::filesystem::remove_all(folder_);
        setenv("XDG_CACHE_HOME", folder_.c_str(), 1);
    }
    ~KeptCheck() override {
        unsetenv("XDG_CACHE_HOME");
        std::filesystem::remove_all(folder_);
    }

    const std::string folder_ = testing::TempDir() + "device_checks";
};

TEST_F(KeptCheck, IsMadeByTheFirstDeviceAndCanBeMadeAgain) {
    EXPECT_FALSE(morphray::kept_device_check().has_value());
    EXPECT_NO_THROW(morphray::Device::vulkan());
    ASSERT_TRUE(morphray::kept_device_check().has_value());
    EXPECT_TRUE(morphray::kept_device_check()->passed);

    morphray::keep_lost_device("", "it did not answer within 60 s");
    const std::optional<morphray::DeviceCheck> lost = morphray::kept_device_check();
    ASSERT_TRUE(lost.has_value());
    EXPECT_FALSE(lost->passed);
    EXPECT_EQ(lost->code, morphray::ErrorCode::device_lost);
    EXPECT_NE(lost->problem.find("did not answer"), std::string::npos);
    EXPECT_NE(lost->problem.find("devices --check"), std::string::npos);
    try {
        morphray::Device::vulkan();
        FAIL();
    } catch (const morphray::Error& error) {
        EXPECT_EQ(error.code(), morphray::ErrorCode::device_lost);
        EXPECT_EQ(error.what(), lost->problem);
    }
    EXPECT_TRUE(morphray::check_vulkan_device().passed);
    EXPECT_NO_THROW(morphray::Device::vulkan());
}

VKAPI_ATTR VkResult VKAPI_CALL lose_device(VkQueue, std::uint32_t, const VkSubmitInfo*, VkFence) {
    return VK_ERROR_DEVICE_LOST;
}
VKAPI_ATTR VkResult VKAPI_CALL lack_memory(VkDevice, const VkBufferCreateInfo*,
                                           const VkAllocationCallbacks*, VkBuffer*) {
    return VK_ERROR_OUT_OF_DEVICE_MEMORY;
}

/// Replaces a function of Vulkan while it lives.
template <class Function>
class Replacement {
public:
    Replacement(Function& function, Function by) : function_(function), before_(function) {
        function_ = by;
    }
    ~Replacement() { function_ = before_; }
    Replacement(const Replacement&) = delete;

private:
    Function& function_;
    Function before_;
};

class LostDevice : public testing::Test {
protected:
    morphray::Device device_ = morphray::Device::vulkan();
    UserMesh mesh_{icosphere(3)};
    std::vector<morphray::Ray> rays_ = world_rays(mesh_, 500, 41);

    morphray::Scene make_scene() const {
        return morphray::Scene::build(mesh_.view(), device_, {.update = morphray::Refit{}});
    }
};

TEST_F(LostDevice, IsReportedByEachCall) {
    morphray::Scene scene = make_scene();
    const std::vector<morphray::Hit> hits = hits_of(scene, rays_);
    {
        const Replacement fails(vkQueueSubmit, lose_device);
        EXPECT_EQ(error_of([&] { hits_of(scene, rays_); }), "device_lost");
        EXPECT_EQ(error_of([&] { scene.occluded(rays_[0]); }), "device_lost");
        EXPECT_EQ(error_of([&] { scene.render({.width = 8, .height = 8}); }), "device_lost");
        EXPECT_EQ(error_of([&] { make_scene(); }), "device_lost");
        for (morphray::Vec3& p : mesh_.points) p.x *= 0.5f;
        EXPECT_EQ(error_of([&] {
                      scene.update();
                      scene.last_update();
                  }),
                  "device_lost");
    }
    for (morphray::Vec3& p : mesh_.points) p.x *= 2;
    expect_same_hits(hits_of(make_scene(), rays_), hits);
}

TEST_F(LostDevice, AChangeWithoutMemoryLeavesOtherScenesAlone) {
    morphray::Scene scene = make_scene();
    const morphray::Scene other = make_scene();
    const std::vector<morphray::Hit> hits = hits_of(other, rays_);
    scene.attach(mesh_.view());
    {
        const Replacement fails(vkCreateBuffer, lack_memory);
        EXPECT_EQ(error_of([&] { scene.update(); }), "limit");
    }
    EXPECT_EQ(error_of([&] { scene.update(); }), "limit");
    EXPECT_EQ(error_of([&] { hits_of(scene, rays_); }), "limit");
    expect_same_hits(hits_of(other, rays_), hits);
}

}  // namespace
}  // namespace mray::test
