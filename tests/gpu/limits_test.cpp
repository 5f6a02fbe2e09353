// Scenes that do not fit are refused before any work, with the numbers.
#include <gtest/gtest.h>

#include <functional>

#include "common/base/errors.h"
#include "gpu/limits.h"
#include "gpu/shared_device.h"
#include "gpu/vulkan/memory.h"
#include "tests/gpu/faulty_loader.h"
#include "tests/gpu/test_scenes.h"

namespace mray::test {
namespace {

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

std::string refusal(const std::function<void()>& action) {
    try {
        action();
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kLimit);
        return error.what();
    }
    return "accepted";
}

void expect_refusal(const gpu::PhysicalDevice& device, const gpu::SceneSize& scene,
                    const char* part) {
    const std::string text =
        refusal([&] { gpu::check_scene(device, gpu::BufferKind::kTexels, scene); });
    EXPECT_NE(text.find(part), std::string::npos) << text;
}

TEST(SceneLimits, AreCheckedForEachOfThem) {
    gpu::PhysicalDevice device = roomy();
    gpu::check_scene(device, gpu::BufferKind::kTexels, kDragon);
    device.limits.maxTexelBufferElements = 65536;
    expect_refusal(device, kDragon, "hold 65536");
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

TEST(SceneLimits, AreThoseOfStorageBuffersWhereTheseAreRead) {
    gpu::PhysicalDevice device = roomy();
    device.limits.maxTexelBufferElements = 65536;
    gpu::check_scene(device, gpu::BufferKind::kStorage, kDragon);
    device.limits.maxStorageBufferRange = 1u << 20;
    EXPECT_NE(refusal([&] {
                  gpu::check_scene(device, gpu::BufferKind::kStorage, kDragon);
              }).find("storage buffers hold"),
              std::string::npos);
}

TEST(BufferKind, IsStorageForAGpuThatBindsEnough) {
    gpu::PhysicalDevice device = roomy();
    device.limits.maxPerStageDescriptorStorageBuffers = gpu::kMostStorageBuffers;
    device.limits.maxDescriptorSetStorageBuffers = gpu::kMostStorageBuffers;
    device.info.type = "discrete";
    EXPECT_EQ(gpu::buffer_kind(device, {}), gpu::BufferKind::kStorage);
    device.info.type = "cpu";
    EXPECT_EQ(gpu::buffer_kind(device, {}), gpu::BufferKind::kTexels);
    device.info.type = "discrete";
    device.limits.maxPerStageDescriptorStorageBuffers = 4;
    EXPECT_EQ(gpu::buffer_kind(device, {}), gpu::BufferKind::kTexels);
}

TEST(PassSize, ShrinksToSmallStorageBuffers) {
    gpu::PhysicalDevice device = roomy();
    EXPECT_EQ(gpu::pass_size(device, {}).tiles, 32768u);
    device.info.type = "cpu";
    EXPECT_EQ(gpu::pass_size(device, {}).tiles, 4096u);
    device.limits.maxStorageBufferRange = 1u << 20;
    const gpu::PassSize small = gpu::pass_size(device, {});
    EXPECT_EQ(small.tiles, ((1u << 20) - 16) / (64 * sizeof(Suspended)));
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
    gpu::PhysicalDevice device = roomy();
    device.limits.maxStorageBufferRange = 1u << 10;
    EXPECT_NE(refusal([&] { gpu::pass_size(device, {}); }), "accepted");
    device = roomy();
    device.limits.maxPushConstantsSize = 64;
    EXPECT_NE(refusal([&] { gpu::pass_size(device, {}); }), "accepted");
    device = roomy();
    device.limits.maxComputeWorkGroupInvocations = 32;
    EXPECT_NE(refusal([&] { gpu::pass_size(device, {}); }), "accepted");
}

TEST(SmallDevice, RefusesASceneAndGoesOnWithASmallerOne) {
    Faults faults;
    faults.edit_properties = [](VkPhysicalDeviceProperties& p) {
        p.limits.maxTexelBufferElements = 65536;
        p.limits.maxStorageBufferRange = 1u << 20;
    };
    const FaultyLoader loader(faults);
    const std::unique_ptr<Backend> backend = gpu::make_vulkan_backend({}, {.loader = loader.get()});
    const DeviceScene large = torus(256, 128);
    const DeviceScene small = torus(32, 16);
    backend->set_scene(small.topology, small.positions, plain_tree(small));
    Frame before, after;
    backend->trace_image(view(200, 150, kRaysPrimary), before);
    EXPECT_NE(
        refusal([&] { backend->set_scene(large.topology, large.positions, plain_tree(large)); }),
        "accepted");
    backend->trace_image(view(200, 150, kRaysPrimary), after);
    EXPECT_EQ(hits_hash(before), hits_hash(after));
}

}  // namespace
}  // namespace mray::test
