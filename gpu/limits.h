// Checks sizes against the device's limits: drivers do not always refuse larger ones.
#pragma once

#include <cstdint>

#include "gpu/vulkan/device.h"

namespace mray::gpu {

/// Storage buffers that a kernel binds at most.
inline constexpr std::uint32_t kMostStorageBuffers = 10;

/// The steps of a lane before it suspends its ray: the tuning's, else kStepBudget on a CPU, and on
/// a GPU so many that its longest dispatch stays below a second.
std::uint32_t step_budget(const PhysicalDevice& device, const Tuning& tuning);

struct SceneSize {
    std::uint64_t vertices = 0;
    std::uint64_t triangles = 0;
    std::uint64_t nodes = 0;
    std::uint64_t leaves = 0;
    std::uint64_t depth = 0;
    /// Triangles that are in no leaf (Bvh::repeated).
    std::uint64_t repeated = 0;
};

/// The fastest buffers in which the device holds such a scene, or the tuning's kind. Throws
/// Error(kLimit), with the numbers, if there are none.
BufferKind choose_buffers(const PhysicalDevice& device, const Tuning& tuning,
                          const SceneSize& scene);

/// How much goes into one dispatch.
struct PassSize {
    std::uint32_t tiles = 0;         // of 64 rays
    std::uint32_t resume_slots = 0;  // suspended rays of a round, a multiple of 64

    std::uint32_t rays() const { return tiles * kGroupSize; }
    bool operator==(const PassSize&) const = default;
};

/// The tuning's sizes, reduced to the device's limits. By default a CPU gets 2^18 rays a dispatch,
/// a GPU the 2^21 that fill it if it has the memory. Throws Error(kLimit) if a single tile does not
/// fit, or if the device lacks the workgroups and arguments that Vulkan guarantees.
PassSize pass_size(const PhysicalDevice& device, const Tuning& tuning);

}  // namespace mray::gpu
