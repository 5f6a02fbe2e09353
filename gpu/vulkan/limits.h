// What fits on a device, decided before anything is allocated: drivers do not always refuse what is
// over their limits.
#pragma once

#include <cstdint>

#include "gpu/tuning.h"
#include "gpu/vulkan/device_info.h"

namespace morphray::gpu {

struct SceneSize {
    std::uint64_t vertices = 0;
    std::uint64_t triangles = 0;
    std::uint64_t nodes = 0;
    std::uint64_t leaves = 0;
    std::uint64_t depth = 0;
};

/// Throws Error(kLimit), with the numbers, if the device cannot hold such a scene.
void check_scene(const PhysicalDevice& device, const SceneSize& scene);

/// Whether it can.
bool fits(const PhysicalDevice& device, const SceneSize& scene);

/// Whether there is also room for two keyframes, and kernels can write positions.
bool fits_keyframes(const PhysicalDevice& device, const SceneSize& scene);

/// How much of an image or batch goes into one dispatch.
struct PassSize {
    /// Tiles of 64 rays.
    std::uint32_t tiles = 0;
    /// Suspended rays a round, a multiple of 64.
    std::uint32_t resume_slots = 0;

    std::uint32_t rays() const { return tiles * kGroupSize; }
};

/// What the tuning asks for, cut down to the device's limits. Throws Error(kLimit) if not even one
/// tile fits, or the device lacks the workgroups and arguments that Vulkan promises.
PassSize pass_size(const VkPhysicalDeviceLimits& limits, const Tuning& tuning);

}  // namespace morphray::gpu
