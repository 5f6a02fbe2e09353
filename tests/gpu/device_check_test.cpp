// A device proves itself before it is used: wrong and lost ones are found, and results are kept.
// Scenes of the library on a device that fails.
#include <gtest/gtest.h>
#include <xmmintrin.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "common/base/errors.h"
#include "gpu/shared_device.h"
#include "gpu/vulkan/pipeline.h"
#include "gpu/vulkan/vulkan_api.h"
#include "gpu/vulkan_backend.h"
#include "library/src/device_impl.h"
#include "library/src/self_test.h"
#include "morphray/error.hpp"
#include "tests/gpu/faulty_loader.h"
#include "tests/library/scenes.h"

namespace mray::test {
namespace {

enum Op : std::uint32_t {
    kCapability = 17,
    kTypeFloat = 22,
    kConstant = 43,
    kConvert = 115,
    kNegate = 127,
    kAdd = 129,
    kSubtract = 131,
    kMultiply = 133,
};

/// A kernel as instructions: the words of each.
class Module {
public:
    using Instruction = std::vector<std::uint32_t>;

    explicit Module(std::vector<std::uint32_t>& words) : words_(words) {
        for (const gpu::SpirvInstruction& i : gpu::read_spirv(words)) {
            instructions.push_back({i.opcode});
            instructions.back().insert(instructions.back().end(), i.operands.begin(),
                                       i.operands.end());
        }
    }
    ~Module() {
        words_.resize(5);
        for (const Instruction& i : instructions) {
            words_.push_back(static_cast<std::uint32_t>(i.size()) << 16 | i[0]);
            words_.insert(words_.end(), i.begin() + 1, i.end());
        }
    }
    Module(const Module&) = delete;

    std::uint32_t new_id() { return words_[3]++; }
    /// Replaces instructions by those that `replacement` returns, if any.
    template <class Replacement>
    void replace(const Replacement& replacement) {
        std::vector<Instruction> result;
        for (const Instruction& i : instructions) {
            std::vector<Instruction> by = replacement(i);
            if (by.empty()) by = {i};
            result.insert(result.end(), by.begin(), by.end());
        }
        instructions = std::move(result);
    }

    std::vector<Instruction> instructions;

private:
    std::vector<std::uint32_t>& words_;
};

using Instructions = std::vector<Module::Instruction>;

/// Exchanges sums and differences, and turns infinity into 1.
void break_kernel(std::vector<std::uint32_t>& words) {
    Module module(words);
    for (Module::Instruction& i : module.instructions) {
        if (i[0] == kAdd || i[0] == kSubtract) i[0] = kAdd + kSubtract - i[0];
        if (i[0] == kConstant && i[3] == 0x7F800000) i[3] = 0x3F800000;
    }
}

/// a - b as -(b - a), whose zeros have the other sign.
void lose_signs_of_zeros(std::vector<std::uint32_t>& words) {
    Module module(words);
    module.replace([&](const Module::Instruction& i) -> Instructions {
        if (i[0] != kSubtract) return {};
        const std::uint32_t difference = module.new_id();
        return {{kSubtract, i[1], difference, i[4], i[3]}, {kNegate, i[1], i[2], difference}};
    });
}

/// (x + y) + z as x + (y + z).
void reorder_sums(std::vector<std::uint32_t>& words) {
    Module module(words);
    std::map<std::uint32_t, Module::Instruction> sums;
    for (const Module::Instruction& i : module.instructions)
        if (i[0] == kAdd) sums[i[2]] = i;
    module.replace([&](const Module::Instruction& i) -> Instructions {
        if (i[0] != kAdd || !sums.contains(i[3])) return {};
        const Module::Instruction& first = sums[i[3]];
        const std::uint32_t rest = module.new_id();
        return {{kAdd, i[1], rest, first[4], i[4]}, {kAdd, i[1], i[2], first[3], rest}};
    });
}

/// a * b + c in doubles, which round once, as a fused operation does.
void fuse_products(std::vector<std::uint32_t>& words) {
    Module module(words);
    std::map<std::uint32_t, Module::Instruction> products;
    for (const Module::Instruction& i : module.instructions)
        if (i[0] == kMultiply) products[i[2]] = i;
    const std::uint32_t wide = module.new_id();
    std::uint32_t scalar = 0;
    module.instructions.insert(module.instructions.begin(), {kCapability, 10});
    module.replace([&](const Module::Instruction& i) -> Instructions {
        if (i[0] == kTypeFloat) {
            scalar = i[1];
            return {i, {kTypeFloat, wide, 64}};
        }
        if (i[0] != kAdd || i[1] != scalar || !products.contains(i[3])) return {};
        const Module::Instruction& product = products[i[3]];
        std::uint32_t id[5];
        for (std::uint32_t& one : id) one = module.new_id();
        return {{kConvert, wide, id[0], product[3]}, {kConvert, wide, id[1], product[4]},
                {kConvert, wide, id[2], i[4]},       {kMultiply, wide, id[3], id[0], id[1]},
                {kAdd, wide, id[4], id[3], id[2]},   {kConvert, scalar, i[2], id[4]}};
    });
}

/// What the self-test says of a device with faults. A short budget and copies through staging take
/// all kernels. The threads of a device on the CPU inherit `float_mode`.
std::string difference(Faults& faults, gpu::BufferKind kind, unsigned float_mode = 0) {
    const FaultyLoader loader(faults);
    const gpu::Tuning tuning{
        .step_budget = 200, .buffer_kind = kind, .force_staging = true, .loader = loader.get()};
    const unsigned mode_before = _mm_getcsr();
    _mm_setcsr(mode_before | float_mode);
    const std::shared_ptr<gpu::SharedDevice> device = gpu::open_device({}, tuning);
    _mm_setcsr(mode_before);
    const morphray::Device tested = morphray::detail::DeviceImpl::make_on_device(
        [=] { return gpu::make_backend_on(device, tuning); });
    const std::string found = morphray::detail::find_difference(tested);
    return found == "denormals" && float_mode == 0 ? "" : found;
}

/// Other devices may lack doubles, and do not have the modes of the CPU's unit.
bool is_lavapipe() { return gpu::find_device("").prefers_texels; }

TEST(DeviceCheck, PassesADeviceWithTheBitsOfTheCpu) {
    Faults none;
    EXPECT_EQ(difference(none, gpu::BufferKind::kTexels), "");
    Faults no_promise;
    no_promise.edit_float_controls = [](auto& f) { f.shaderRoundingModeRTEFloat32 = VK_FALSE; };
    EXPECT_EQ(difference(no_promise, gpu::BufferKind::kStorage), "");
}

std::size_t kernel_files() {
    std::size_t count = 0;
    for (const auto& file : std::filesystem::recursive_directory_iterator(MORPHRAY_SHADERS))
        count += file.path().extension() == ".comp";
    return count;
}

TEST(DeviceCheck, FindsEachWrongKernel) {
    // Two threads compile them, in any order; `compact`, `pack_hits` and the refit of nodes
    // subtract nothing.
    std::vector<std::vector<std::uint32_t>> kernels;
    Faults listing;
    listing.edit_kernel = [&](std::vector<std::uint32_t>& words) {
        if (std::ranges::find(kernels, words) == kernels.end()) kernels.push_back(words);
    };
    EXPECT_EQ(difference(listing, gpu::BufferKind::kTexels), "");
    EXPECT_EQ(kernels.size(), kernel_files());
    std::size_t found = 0;
    for (const std::vector<std::uint32_t>& broken : kernels) {
        Faults faults;
        bool changed = false;
        faults.edit_kernel = [&](std::vector<std::uint32_t>& words) {
            if (words != broken) return;
            break_kernel(words);
            changed = words != broken;
        };
        const std::string text = difference(faults, gpu::BufferKind::kTexels);
        EXPECT_EQ(!text.empty(), changed) << found;
        found += changed;
    }
    EXPECT_EQ(found, 15u);
}

TEST(DeviceCheck, FindsFusedAndReorderedOperationsAndLostSignsOfZeros) {
    if (!is_lavapipe()) return;
    using enum gpu::BufferKind;
    Faults fused, reordered, signs;
    fused.edit_kernel = fuse_products;
    EXPECT_EQ(difference(fused, kTexels), "closest hits");
    reordered.edit_kernel = reorder_sums;
    EXPECT_EQ(difference(reordered, kStorage), "closest hits");
    signs.edit_kernel = lose_signs_of_zeros;
    EXPECT_EQ(difference(signs, kTexels), "signs of zeros");
}

TEST(DeviceCheck, FindsAnotherRoundingAndFlushedDenormals) {
    if (!is_lavapipe()) return;
    constexpr unsigned kDown = 0x2000, kUp = 0x4000, kToZero = 0x6000, kFlush = 0x8040;
    Faults none;
    for (const unsigned mode : {kDown, kUp, kToZero})
        EXPECT_EQ(difference(none, gpu::BufferKind::kTexels, mode), "closest hits") << mode;
    EXPECT_EQ(difference(none, gpu::BufferKind::kStorage, kFlush), "denormals");
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
    } catch (const morphray::Error& error) {
        EXPECT_EQ(error.code(), morphray::ErrorCode::device_lost);
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
