// The list of devices, the choice of one, the messages if none can be used, and the scenes that a
// device refuses before any work.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <optional>
#include <vector>

#include <sys/resource.h>

#include "cpu/cpu_backend.h"
#include "gpu/limits.h"
#include "gpu/shared_device.h"
#include "gpu/vulkan/device.h"
#include "gpu/vulkan/memory.h"
#include "tests/gpu/faulty_loader.h"
#include "tests/gpu/test_scenes.h"
#include "tests/support/backend_results.h"
#include "tests/support/thrown_error.h"

namespace mray::test {
namespace {

using testing::TempDir;

/// The message of the error of this kind that an action throws.
template <class Action>
std::string error_text(const Action& action, ErrorKind kind = ErrorKind::kUnavailable) {
    const std::optional<Error> error = error_of(action);
    EXPECT_EQ(error ? std::optional(error->kind()) : std::nullopt, kind);
    return error ? error->what() : "";
}

gpu::DeviceInfo info(std::uint32_t index, const char* name, const char* type,
                     const char* unusable = "") {
    gpu::DeviceInfo d;
    d.index = index;
    d.name = name;
    d.type = type;
    d.uuid = std::string(32, '0');
    d.uuid.back() = static_cast<char>('1' + index);
    d.unusable = unusable;
    return d;
}

const std::vector<gpu::DeviceInfo> kDevices = {
    info(0, "llvmpipe (256 bits)", "cpu"),
    info(1, "Example Arc 1", "integrated"),
    info(2, "Example Force 2", "discrete"),
    info(3, "Example Force 3", "discrete", "it has no compute queue"),
};

TEST(DeviceChoice, PrefersDiscreteThenIntegratedThenVirtualThenCpu) {
    EXPECT_EQ(gpu::choose_device(kDevices, ""), 2u);
    EXPECT_EQ(gpu::choose_device(std::span(kDevices).first(2), ""), 1u);
    EXPECT_EQ(gpu::choose_device(std::span(kDevices).first(1), ""), 0u);
}

TEST(DeviceChoice, TakesAnIndexAPartOfANameOrAUuid) {
    for (const auto& [wanted, index] : {std::pair("0", 0u),
                                        {"LLVMPIPE", 0u},
                                        {"force 2", 2u},
                                        {"00000000-0000-0000-0000-000000000002", 1u}})
        EXPECT_EQ(gpu::choose_device(kDevices, wanted), index) << wanted;
}

TEST(DeviceChoice, NamesTheDevicesWhenNoneOrSeveralFitAndSaysWhyOneCannotBeUsed) {
    const char* const kAll = "1: Example Arc 1, 2: Example Force 2";
    for (const auto& [wanted, part] : {std::pair("9", kAll),
                                       {"99999999999999999999999", kAll},
                                       {"banana", kAll},
                                       {"00000000000000000000000000000009", kAll},
                                       {"example", kAll},
                                       {"example", "more than one"},
                                       {"3", "it has no compute queue"}}) {
        const std::string text = error_text([&] { gpu::choose_device(kDevices, wanted); });
        EXPECT_TRUE(has(text, wanted));
        EXPECT_TRUE(has(text, part));
    }
    EXPECT_TRUE(has(error_text([] { gpu::choose_device(std::span(kDevices).last(1), ""); }),
                    "no usable device: Example Force 3: it has no compute queue"));
}

TEST(DeviceList, HasAUsableDeviceWithEverythingFilledIn) {
    const std::vector<gpu::DeviceInfo> devices = gpu::list_devices();
    ASSERT_FALSE(devices.empty());
    const gpu::DeviceInfo& first = devices[gpu::choose_device(devices, "")];
    EXPECT_EQ(first.uuid.size(), 32u);
    EXPECT_FALSE(first.name.empty());
    EXPECT_FALSE(first.driver.empty());
    EXPECT_GE(first.api_major * 100 + first.api_minor, 101u);
    EXPECT_GT(first.memory_bytes, 0u);
    EXPECT_GT(first.subgroup_size, 0u);
}

gpu::DeviceInfo first_device(Faults faults) {
    const FaultyLoader loader(faults);
    return gpu::list_devices(loader.get()).front();
}

TEST(DeviceList, GivesTheReasonWhyADeviceIsUnusable) {
    EXPECT_TRUE(
        has(first_device({.edit_properties = [](auto& p) { p.apiVersion = VK_API_VERSION_1_0; }})
                .unusable,
            "only Vulkan 1.0"));
    EXPECT_TRUE(has(
        first_device({.edit_queue_family = [](auto& f) { f.queueFlags = VK_QUEUE_TRANSFER_BIT; }})
            .unusable,
        "no compute queue"));
}

TEST(DeviceList, SaysWhatADriverPromises) {
    for (const auto& [rounds, keeps_zeros] :
         {std::pair(VK_TRUE, VK_TRUE), {VK_FALSE, VK_TRUE}, {VK_TRUE, VK_FALSE}}) {
        const VkBool32 promises[] = {rounds, keeps_zeros};
        const gpu::DeviceInfo device = first_device({.edit_float_controls = [&](auto& f) {
            f.shaderRoundingModeRTEFloat32 = promises[0];
            f.shaderSignedZeroInfNanPreserveFloat32 = promises[1];
        }});
        EXPECT_EQ(device.unusable, "");
        EXPECT_EQ(device.promises_floats, rounds == VK_TRUE && keeps_zeros == VK_TRUE);
    }
}

TEST(DeviceList, SaysThatThereIsNoDevice) {
    Faults faults;
    faults.hide_devices = true;
    const FaultyLoader loader(faults);
    EXPECT_TRUE(has(error_text([&] { gpu::list_devices(loader.get()); }), "no device"));
}

/// Sets an environment variable during its lifetime.
class Environment {
public:
    Environment(const char* name, const std::string& value) : name_(name) {
        if (const char* old = std::getenv(name)) old_ = old;
        setenv(name, value.c_str(), 1);
    }
    ~Environment() {
        if (old_) {
            setenv(name_, old_->c_str(), 1);
        } else {
            unsetenv(name_);
        }
    }
    Environment(const Environment&) = delete;
    Environment& operator=(const Environment&) = delete;

private:
    const char* name_;
    std::optional<std::string> old_;
};

std::string written(const char* name, const std::string& text) {
    const std::string path = TempDir() + name;
    std::ofstream(path) << text;
    return path;
}

/// Lists devices by an instance of its own; that of the process may be older than its environment.
void list_anew() { first_device({}); }

TEST(Installation, WithoutADriverSaysSo) {
    const Environment none("VK_ICD_FILENAMES", TempDir() + "no_such_manifest.json");
    EXPECT_TRUE(has(error_text(list_anew), "no driver"));
}

TEST(Installation, WithAMalformedManifestSaysThatItCannotBeRead) {
    const Environment broken("VK_ICD_FILENAMES", written("malformed.json", "{ \"file_format"));
    const std::string text = error_text(list_anew);
    EXPECT_TRUE(has(text, "no driver on this machine")) << text;
    EXPECT_TRUE(has(text, "manifest can")) << text;
    EXPECT_TRUE(has(text, "VK_ICD_FILENAMES")) << text;
}

TEST(Installation, WithADriverThatIsNoLibrarySaysThatThereIsNone) {
    const std::string library = written("libnonsense.so", "nonsense");
    const std::string manifest = R"({"file_format_version": "1.0.0", "ICD": {"library_path": ")" +
                                 library + R"(", "api_version": "1.3.0"}})";
    const Environment broken("VK_ICD_FILENAMES", written("nonsense.json", manifest));
    const std::string text = error_text(list_anew);
    EXPECT_TRUE(has(text, "no driver"));
    EXPECT_TRUE(has(text, "the library that it names missing"));
}

TEST(Installation, WithoutAddressSpaceForADriverSaysThatMemoryIsShort) {
    const Environment none("VK_ICD_FILENAMES", TempDir() + "no_such_manifest.json");
    rlimit before;
    ASSERT_EQ(getrlimit(RLIMIT_AS, &before), 0);
    std::size_t pages = 0;
    std::ifstream("/proc/self/statm") >> pages;
    rlimit tight = before;
    tight.rlim_cur = pages * static_cast<std::size_t>(getpagesize()) + (std::size_t{64} << 20);
    ASSERT_EQ(setrlimit(RLIMIT_AS, &tight), 0);
    const std::string text = error_text(list_anew, ErrorKind::kLimit);
    setrlimit(RLIMIT_AS, &before);
    EXPECT_TRUE(has(text, "ulimit -v"));
}

TEST(Installation, WithoutTheLayerSaysThatValidationIsNotInstalled) {
    const Environment none("VK_LAYER_PATH", TempDir() + "no_such_folder");
    EXPECT_TRUE(has(error_text([] { gpu::make_vulkan_backend({.device = "", .validate = true}); }),
                    "VK_LAYER_KHRONOS_validation is not installed"));
}

gpu::PhysicalDevice roomy() {
    gpu::PhysicalDevice device;
    device.limits.maxTexelBufferElements = 1u << 27;
    device.limits.maxStorageBufferRange = 1u << 27;
    device.limits.maxComputeWorkGroupCount[0] = 65535;
    device.limits.maxComputeWorkGroupInvocations = 128;
    device.limits.maxComputeWorkGroupSize[0] = 128;
    device.limits.maxPushConstantsSize = 128;
    device.max_allocation = std::uint64_t{1} << 31;
    device.info.memory_bytes = std::uint64_t{1} << 32;
    return device;
}

/// Types of memory, in the order of a device.
VkPhysicalDeviceMemoryProperties memory_types(const std::vector<VkMemoryPropertyFlags>& types) {
    VkPhysicalDeviceMemoryProperties properties = {};
    properties.memoryTypeCount = static_cast<std::uint32_t>(types.size());
    for (std::size_t i = 0; i < types.size(); ++i)
        properties.memoryTypes[i].propertyFlags = types[i];
    return properties;
}

constexpr VkMemoryPropertyFlags kLocal = VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT;
constexpr VkMemoryPropertyFlags kVisible =
    VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
constexpr VkMemoryPropertyFlags kCached = VK_MEMORY_PROPERTY_HOST_CACHED_BIT;

void expect_memory(const VkPhysicalDeviceMemoryProperties& types, gpu::Memory memory,
                   std::uint32_t type, bool is_mapped, std::uint32_t allowed = ~0u) {
    const gpu::MemoryChoice choice = gpu::choose_memory(types, allowed, memory);
    EXPECT_EQ(choice.type, type);
    EXPECT_EQ(choice.is_mapped, is_mapped);
}

// A card with memory of its own, part of which the host sees without a cache, as NVIDIA's have.
TEST(Memory, OfACardIsStagedThroughCachedMemoryOfTheHost) {
    const auto types = memory_types({0, kLocal, kVisible, kVisible | kCached, kLocal | kVisible});
    expect_memory(types, gpu::Memory::kDevice, 1, false);
    expect_memory(types, gpu::Memory::kHost, 3, true);
    // Where a buffer allows only the part that the host sees, it is not read without a cache.
    expect_memory(types, gpu::Memory::kDevice, 4, false, 1u << 4);
    // Uncached memory is mapped for copies.
    expect_memory(types, gpu::Memory::kHost, 2, true, 0b10111);
}

TEST(Memory, ThatDeviceAndHostShareIsMapped) {
    const auto types = memory_types({kLocal, kLocal | kVisible, kLocal | kVisible | kCached});
    expect_memory(types, gpu::Memory::kDevice, 2, true);
    expect_memory(types, gpu::Memory::kHost, 2, true);
}

TEST(Memory, ThatNoBufferAllowsIsAnError) {
    const auto types = memory_types({kLocal});
    EXPECT_THROW(gpu::choose_memory(types, 1, gpu::Memory::kHost), Error);
    EXPECT_THROW(gpu::choose_memory(types, 0, gpu::Memory::kDevice), Error);
}

const gpu::SceneSize kDragon = {
    .vertices = 435'545, .triangles = 871'306, .nodes = 6'300, .leaves = 72'600, .depth = 6};

void expect_refusal(const gpu::PhysicalDevice& device, const gpu::SceneSize& scene,
                    const char* part) {
    EXPECT_TRUE(
        has(error_text([&] { gpu::choose_buffers(device, {}, scene); }, ErrorKind::kLimit), part));
}

TEST(SceneLimits, AreCheckedForEachOfThem) {
    gpu::PhysicalDevice device = roomy();
    gpu::choose_buffers(device, {}, kDragon);
    device.limits.maxTexelBufferElements = 65536;
    expect_refusal(device, kDragon, "hold 65536; use a smaller scene");
    device = roomy();
    device.max_allocation = 1u << 20;
    expect_refusal(device, kDragon, "an allocation of");
    device = roomy();
    device.info.memory_bytes = 1u << 24;
    expect_refusal(device, kDragon, "the device has 16777216");
    gpu::SceneSize deep = kDragon;
    deep.depth = kMaxDepth + 1;
    expect_refusal(roomy(), deep, "17 levels");
    gpu::SceneSize huge = kDragon;
    huge.leaves = std::uint64_t{1} << 40;
    expect_refusal(roomy(), huge, "leaves take");
}

TEST(Buffers, AreTheFastestThatHoldTheScene) {
    using enum gpu::BufferKind;
    const auto chosen = [](const gpu::PhysicalDevice& device) {
        return gpu::choose_buffers(device, {}, kDragon);
    };
    gpu::PhysicalDevice device = roomy();
    EXPECT_EQ(chosen(device), kTexels) << "kernels bind more storage buffers than it has";
    device.limits.maxPerStageDescriptorStorageBuffers = gpu::kMostStorageBuffers;
    device.limits.maxDescriptorSetStorageBuffers = gpu::kMostStorageBuffers;
    EXPECT_EQ(chosen(device), kStorage);
    device.limits.maxStorageBufferRange = 1u << 20;
    EXPECT_EQ(chosen(device), kTexels);
    device.limits.maxStorageBufferRange = 1u << 27;
    device.info.prefers_texels = true;
    EXPECT_EQ(chosen(device), kTexels);
    device.limits.maxTexelBufferElements = 65536;
    EXPECT_EQ(chosen(device), kStorage);
    device.limits.maxStorageBufferRange = 1u << 20;
    expect_refusal(device, kDragon, "storage buffers hold 65536");
}

TEST(PassSize, ShrinksToSmallStorageBuffers) {
    gpu::PhysicalDevice device = roomy();
    EXPECT_EQ(gpu::pass_size(device, {}).tiles, 32767u) << "beside the header";
    device.info.type = "cpu";
    EXPECT_EQ(gpu::pass_size(device, {}).tiles, 4096u);
    device.limits.maxStorageBufferRange = 1u << 20;
    const gpu::PassSize small = gpu::pass_size(device, {});
    EXPECT_EQ(small.tiles, ((1u << 20) - sizeof(WorkHeader)) / (64 * sizeof(Suspended)));
    EXPECT_LE(small.resume_slots * 4 * kStateUints, 1u << 20);
    EXPECT_EQ(small.resume_slots % 64, 0u);
}

TEST(PassSize, LeavesRoomForPaddingInSmallTexelBuffers) {
    gpu::PhysicalDevice device = roomy();
    device.limits.maxTexelBufferElements = 65536;
    // Two texels a ray.
    const std::uint32_t tiles = gpu::pass_size(device, {}).tiles;
    EXPECT_EQ(tiles, 65536 / (64 * 2) - 1);
}

TEST(PassSize, IsRefusedWhereNotOneTileFits) {
    for (const auto& [limit, value] :
         {std::pair(&VkPhysicalDeviceLimits::maxStorageBufferRange, 1u << 10),
          {&VkPhysicalDeviceLimits::maxPushConstantsSize, 64u},
          {&VkPhysicalDeviceLimits::maxComputeWorkGroupInvocations, 32u}}) {
        gpu::PhysicalDevice device = roomy();
        device.limits.*limit = value;
        EXPECT_EQ(kind_of([&] { gpu::pass_size(device, {}); }), ErrorKind::kLimit) << value;
    }
}

TEST(SmallDevice, RefusesASceneAndGoesOnWithASmallerOne) {
    Faults faults;
    faults.edit_properties = [](VkPhysicalDeviceProperties& p) {
        p.limits.maxTexelBufferElements = 65536;
        p.limits.maxStorageBufferRange = 1u << 20;
    };
    const FaultyLoader loader(faults);
    const std::unique_ptr<Backend> backend = gpu::make_vulkan_backend({}, {.loader = loader.get()});
    const TestScene large = torus(256, 128);
    const TestScene small = torus(32, 16);
    set_scene(*backend, small, built_tree(small));
    Frame before, after;
    backend->trace_image(view(200, 150, kRaysPrimary), before);
    EXPECT_EQ(kind_of([&] { set_scene(*backend, large, built_tree(large)); }), ErrorKind::kLimit);
    backend->trace_image(view(200, 150, kRaysPrimary), after);
    EXPECT_EQ(hits_hash(before), hits_hash(after));
}

TEST(SmallDevice, TakesBuffersOfAnotherKindForATreeThatTexelsDoNotHold) {
    const TestScene scene = torus(32, 16);
    const Bvh small = built_tree(scene);
    const Bvh large = loose_tree(scene);
    Faults faults;
    faults.edit_properties = [&](VkPhysicalDeviceProperties& p) {
        const std::size_t leaves = (small.leaves.size() + large.leaves.size()) / 2;
        p.limits.maxTexelBufferElements = static_cast<std::uint32_t>(4 * kLeafVec4s * leaves);
    };
    faults.counts = [](std::string_view name) { return name == "vkCreateBufferView"; };
    const FaultyLoader loader(faults);
    const std::unique_ptr<Backend> device = gpu::make_vulkan_backend({}, {.loader = loader.get()});
    const std::unique_ptr<Backend> cpu = cpu::make_scalar_backend();
    const auto expect_equal = [&](bool reads_texels) {
        EXPECT_EQ(image_hashes(*device, view(60, 40, kRaysAo)),
                  image_hashes(*cpu, view(60, 40, kRaysAo)));
        EXPECT_EQ(faults.call_count > 0, reads_texels);
        faults.call_count = 0;
    };
    MovingScene on_device(*device, scene, small);
    MovingScene on_cpu(*cpu, scene, small);
    expect_equal(true);
    for (Backend* backend : {device.get(), cpu.get()}) backend->set_tree(large);
    expect_equal(false);
    for (Backend* backend : {device.get(), cpu.get()}) {
        backend->edit_tree([&](Bvh& tree) {
            tree = small;
            return true;
        });
    }
    expect_equal(true);
    for (MovingScene* moving : {&on_device, &on_cpu}) moving->refit(swayed(scene, 1));
    EXPECT_EQ(image_hashes(*device, view(60, 40, kRaysAo)),
              image_hashes(*cpu, view(60, 40, kRaysAo)));
}

}  // namespace
}  // namespace mray::test
