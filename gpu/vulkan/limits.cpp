#include "gpu/vulkan/limits.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/base/errors.h"
#include "common/bvh/bvh.h"

namespace mray::gpu {
namespace {

[[noreturn]] void over(const std::string& text) {
    throw Error(ErrorKind::kLimit,
                "Vulkan: " + text + "; use a smaller scene, another device or the CPU backend");
}

/// Buffers have at least 48 bytes and up to 31 more than needed: in words of 4.
constexpr std::uint64_t kPadding = 12;

void check_elements(const PhysicalDevice& device, const char* what, std::uint64_t elements) {
    // Kernels index texels with signed integers.
    constexpr std::uint64_t kMaxIndex = 0x7FFFFFFF;
    const std::uint64_t limit =
        std::min<std::uint64_t>(device.limits.maxTexelBufferElements, kMaxIndex);
    if (elements + kPadding > limit) {
        over(fmt::format("the scene's {} take {} elements, the device's texel buffers hold {}",
                         what, elements, limit));
    }
}

void check_bytes(const PhysicalDevice& device, std::uint64_t largest, std::uint64_t total) {
    if (largest > device.max_allocation) {
        over(fmt::format("the scene needs an allocation of {} bytes, the device allows {}", largest,
                         device.max_allocation));
    }
    if (total > device.info.memory_bytes) {
        over(fmt::format("the scene takes {} bytes, the device has {}", total,
                         device.info.memory_bytes));
    }
}

struct SceneBytes {
    std::uint64_t largest;
    std::uint64_t total;
};

SceneBytes bytes_of(const SceneSize& scene) {
    const std::uint64_t nodes = sizeof(Node) * scene.nodes;
    const std::uint64_t leaves = sizeof(Leaf) * scene.leaves;
    const std::uint64_t vertices = 16 * scene.vertices;
    const std::uint64_t triangles = 16 * scene.triangles;
    const std::uint64_t rest = 4 * scene.nodes + (4 * kLeafVertices + 4) * scene.leaves +
                               sizeof(RepeatedTriangle) * scene.repeated;
    return {std::max({nodes, leaves, vertices, triangles, rest}),
            nodes + leaves + vertices + triangles + rest};
}

std::uint32_t default_tiles(const PhysicalDevice& device) {
    constexpr std::uint64_t kRoomy = std::uint64_t{4} << 30;
    return device.info.type != "cpu" && device.info.memory_bytes >= kRoomy ? 32768 : 4096;
}

}  // namespace

void check_scene(const PhysicalDevice& device, const SceneSize& scene) {
    if (scene.depth > kMaxDepth) {
        over(fmt::format("the tree has {} levels, kernels have stacks for {}", scene.depth,
                         kMaxDepth));
    }
    check_elements(device, "vertices", scene.vertices);
    check_elements(device, "triangles", scene.triangles);
    // The refit writes planes and coordinates one by one.
    check_elements(device, "repeated triangles", 2 * scene.repeated);
    check_elements(device, "nodes", 4 * kNodeVec4s * scene.nodes);
    check_elements(device, "leaves", 4 * kLeafVec4s * scene.leaves);
    const SceneBytes bytes = bytes_of(scene);
    check_bytes(device, bytes.largest, bytes.total);
}

bool fits(const PhysicalDevice& device, const SceneSize& scene) {
    try {
        check_scene(device, scene);
        return true;
    } catch (const Error&) {
        return false;
    }
}

PassSize pass_size(const PhysicalDevice& device, const Tuning& tuning) {
    const VkPhysicalDeviceLimits& limits = device.limits;
    if (limits.maxComputeWorkGroupInvocations < kGroupSize ||
        limits.maxComputeWorkGroupSize[0] < kGroupSize) {
        over(fmt::format(
            "kernels run in workgroups of {}, the device allows {}", kGroupSize,
            std::min(limits.maxComputeWorkGroupInvocations, limits.maxComputeWorkGroupSize[0])));
    }
    if (limits.maxPushConstantsSize < sizeof(RegionArguments)) {
        over(fmt::format("kernels take {} bytes of arguments, the device allows {}",
                         sizeof(RegionArguments), limits.maxPushConstantsSize));
    }
    const std::uint64_t range = limits.maxStorageBufferRange;
    const std::uint64_t room = range - std::min<std::uint64_t>(range, sizeof(WorkHeader));
    const std::uint64_t tiles = std::min<std::uint64_t>({
        tuning.tiles_per_dispatch != 0 ? tuning.tiles_per_dispatch : default_tiles(device),
        room / (kGroupSize * sizeof(Suspended)),
        (limits.maxTexelBufferElements - kPadding) / (kGroupSize * 2),
        limits.maxComputeWorkGroupCount[0],
    });
    const std::uint64_t slots =
        std::min<std::uint64_t>(tuning.resume_slots, range / (4 * kStateUints)) / kGroupSize *
        kGroupSize;
    if (tiles == 0 || slots == 0) {
        over(fmt::format("storage buffers of {} bytes are too small for {} rays at a time", range,
                         kGroupSize));
    }
    return {static_cast<std::uint32_t>(tiles), static_cast<std::uint32_t>(slots)};
}

}  // namespace mray::gpu
