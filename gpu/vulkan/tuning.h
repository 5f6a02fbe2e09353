// Settings that change no result. Tests use them to reach rare paths.
#pragma once

#include <cstdint>

#include "gpu/vulkan/validation_log.h"
#include "gpu/vulkan/vulkan_api.h"
#include "shaders/kernel_interface.h"

namespace mray::gpu {

struct Tuning {
    /// Loop iterations after which a lane suspends its ray, 1 to kStepBudget.
    std::uint32_t step_budget = kStepBudget;
    /// Tiles of 8x8 pixels, or 64 rays, of one dispatch at most; 0: by the device (pass_size()).
    std::uint32_t tiles_per_dispatch = 0;
    /// Suspended rays that one dispatch continues; each takes 2 KB.
    std::uint32_t resume_slots = 4096;
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
