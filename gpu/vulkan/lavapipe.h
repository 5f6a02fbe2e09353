// What the host does for lavapipe; shaders/base/lavapipe.h has what kernels do.
#pragma once

#include <cstdint>

#include "gpu/vulkan/vulkan_api.h"

namespace mray::gpu {

/// Whether lavapipe was told to use vectors of another width than most machines have. Mesa 25.0.7,
/// unlike 22.3.6, then crashes (4 lanes: it stores vectors of 8 to places that are aligned for 4)
/// or gives wrong results (16 lanes: right ones without LLVM's optimisations, GALLIVM_PERF=nopt).
bool has_unsound_width(const VkPhysicalDeviceDriverProperties& driver, std::uint32_t subgroup_size);

/// Rounds up to a multiple of 16 that is not a power of two. Lavapipe compiles a kernel again when
/// it first meets a texel buffer whose size is a power of two, which would disturb times.
VkDeviceSize padded_size(VkDeviceSize size);

}  // namespace mray::gpu
