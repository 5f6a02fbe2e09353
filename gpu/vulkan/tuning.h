// Settings that change no result. Tests use them to reach rare paths.
#pragma once

#include <cstdint>
#include <optional>

#include "gpu/vulkan/vulkan_api.h"
#include "shaders/kernel_interface.h"

namespace mray::gpu {

class ValidationLog;

/// How kernels read buffers that others write.
enum class BufferKind {
    kTexels,   // as texels, which lavapipe reads three times as fast
    kStorage,  // as they are, which a GPU does as fast, and without the bound of 2^27 texels
};

struct Tuning {
    /// Loop iterations after which a lane suspends its ray, 1 to kStepBudget; 0: by the device
    /// (step_budget()).
    std::uint32_t step_budget = 0;
    /// Tiles of 8x8 pixels, or 64 rays, of one dispatch at most; 0: by the device (pass_size()).
    std::uint32_t tiles_per_dispatch = 0;
    /// Suspended rays that one dispatch continues, each of which takes 2 KB; 0: by the device.
    std::uint32_t resume_slots = 0;
    /// How kernels read buffers; unset: by the device (buffer_kind()).
    std::optional<BufferKind> buffer_kind = std::nullopt;
    /// The boxes that rays test beside those of nodes: kTestQuarters, kTestGroups.
    std::uint32_t boxes = kTestQuarters | kTestGroups;
    /// Copy through a staging buffer even if the host sees the device's memory.
    bool force_staging = false;
    /// A submission that takes longer counts as a lost device.
    std::uint64_t submit_timeout_ms = 60'000;
    /// Replaces libvulkan's vkGetInstanceProcAddr; null: it is used.
    PFN_vkGetInstanceProcAddr loader = nullptr;
    /// Receives validation errors, including those at destruction. Must outlive the backend.
    ValidationLog* log = nullptr;
};

}  // namespace mray::gpu
