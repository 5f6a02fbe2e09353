#include "gpu/limits.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <numeric>

#include "common/bvh/bvh.h"

namespace mray::gpu {
namespace {

template <class... Values>
[[noreturn]] void over(fmt::format_string<Values...> text, Values&&... values) {
    throw Error(ErrorKind::kLimit,
                "Vulkan: {}; use a smaller scene, another device or the CPU backend",
                fmt::format(text, std::forward<Values>(values)...));
}

/// Buffers have at least 48 bytes and up to 31 more than needed: in words of 4.
constexpr std::uint64_t kPadding = 12;

/// The kinds of buffers that kernels can bind, the fastest first.
std::vector<BufferKind> usable_kinds(const PhysicalDevice& device, const Tuning& tuning) {
    using enum BufferKind;
    const VkPhysicalDeviceLimits& limits = device.limits;
    if (std::min(limits.maxPerStageDescriptorStorageBuffers,
                 limits.maxDescriptorSetStorageBuffers) < kMostStorageBuffers)
        return {kTexels};
    if (tuning.buffer_kind) return {*tuning.buffer_kind};
    if (device.info.prefers_texels) return {kTexels, kStorage};
    return {kStorage, kTexels};
}

struct BufferSize {
    const char* name;
    /// Texels, of as many bytes each.
    std::uint64_t elements;
    std::uint64_t element_bytes;
};

std::uint64_t most_elements(const PhysicalDevice& device, BufferKind kind,
                            const BufferSize& buffer) {
    // Kernels index texels with signed integers.
    constexpr std::uint64_t kMaxIndex = 0x7FFFFFFF;
    const std::uint64_t limit = kind == BufferKind::kTexels
                                    ? device.limits.maxTexelBufferElements
                                    : device.limits.maxStorageBufferRange / buffer.element_bytes;
    return std::min(limit, kMaxIndex);
}

void check_bytes(const PhysicalDevice& device, const SceneSize& scene) {
    const std::uint64_t parts[] = {
        sizeof(Node) * scene.nodes, sizeof(Leaf) * scene.leaves, 16 * scene.vertices,
        16 * scene.triangles,
        (4 + 16 * kQuarterVec4s) * scene.nodes +
            (4 * vertices_at(1) + 4 + 16 * kQuarterVec4s) * scene.leaves +
            sizeof(RepeatedTriangle) * scene.repeated};
    const std::uint64_t largest = *std::ranges::max_element(parts);
    if (largest > device.max_allocation)
        over("the scene needs an allocation of {} bytes, the device allows {}", largest,
             device.max_allocation);
    const std::uint64_t total =
        std::accumulate(std::begin(parts), std::end(parts), std::uint64_t{0});
    if (total > device.info.memory_bytes)
        over("the scene takes {} bytes, the device has {}", total, device.info.memory_bytes);
}

}  // namespace

std::uint32_t step_budget(const PhysicalDevice& device, const Tuning& tuning) {
    if (tuning.step_budget != 0) return tuning.step_budget;
    return device.info.type == "cpu" ? kStepBudget : 1u << 14;
}

BufferKind choose_buffers(const PhysicalDevice& device, const Tuning& tuning,
                          const SceneSize& scene) {
    if (scene.depth > kMaxDepth)
        over("the tree has {} levels, kernels have stacks for {}", scene.depth, kMaxDepth);
    // The refit writes planes and coordinates one by one.
    const BufferSize buffers[] = {{"vertices", scene.vertices, 16},
                                  {"triangles", scene.triangles, 16},
                                  {"repeated triangles", 2 * scene.repeated, 4},
                                  {"nodes", sizeof(Node) / 4 * scene.nodes, 4},
                                  {"leaves", sizeof(Leaf) / 4 * scene.leaves, 4}};
    std::string problem;
    for (const BufferKind kind : usable_kinds(device, tuning)) {
        const auto* const over_limit = std::ranges::find_if(buffers, [&](const BufferSize& buffer) {
            return buffer.elements + kPadding > most_elements(device, kind, buffer);
        });
        if (over_limit == std::end(buffers)) {
            check_bytes(device, scene);
            return kind;
        }
        problem = fmt::format("the scene's {} take {} elements, the device's {} hold {}",
                              over_limit->name, over_limit->elements,
                              kind == BufferKind::kTexels ? "texel buffers" : "storage buffers",
                              most_elements(device, kind, *over_limit));
    }
    over("{}", problem);
}

PassSize pass_size(const PhysicalDevice& device, const Tuning& tuning) {
    const VkPhysicalDeviceLimits& limits = device.limits;
    if (limits.maxComputeWorkGroupInvocations < kGroupSize ||
        limits.maxComputeWorkGroupSize[0] < kGroupSize) {
        over("kernels run in workgroups of {}, the device allows {}", kGroupSize,
             std::min(limits.maxComputeWorkGroupInvocations, limits.maxComputeWorkGroupSize[0]));
    }
    if (limits.maxPushConstantsSize < sizeof(RegionArguments))
        over("kernels take {} bytes of arguments, the device allows {}", sizeof(RegionArguments),
             limits.maxPushConstantsSize);
    const std::uint64_t range = limits.maxStorageBufferRange;
    const std::uint64_t room = range - std::min<std::uint64_t>(range, sizeof(WorkHeader));
    // A GPU is filled, if it has memory for that.
    constexpr std::uint64_t kRoomy = std::uint64_t{4} << 30;
    const bool is_large = device.info.type != "cpu" && device.info.memory_bytes >= kRoomy;
    PassSize wanted = {tuning.tiles_per_dispatch, tuning.resume_slots};
    if (wanted.tiles == 0) wanted.tiles = is_large ? 32768 : 4096;
    if (wanted.resume_slots == 0) wanted.resume_slots = is_large ? 32768 : 4096;
    const std::uint64_t tiles = std::min<std::uint64_t>({
        wanted.tiles,
        room / (kGroupSize * sizeof(Suspended)),
        (limits.maxTexelBufferElements - kPadding) / (kGroupSize * 2),
        limits.maxComputeWorkGroupCount[0],
    });
    const std::uint64_t slots =
        std::min<std::uint64_t>(wanted.resume_slots, range / (4 * kStateUints)) / kGroupSize *
        kGroupSize;
    if (tiles == 0 || slots == 0)
        over("storage buffers of {} bytes are too small for {} rays at a time", range, kGroupSize);
    return {static_cast<std::uint32_t>(tiles), static_cast<std::uint32_t>(slots)};
}

}  // namespace mray::gpu
