// What a Vulkan device has to prove before it is used: the answers of the digest, bit by bit.
#pragma once

#include <optional>
#include <string>

#include "gpu/vulkan/vulkan_config.h"
#include "morphray/device.hpp"

namespace morphray::detail {

/// What differs first from the CPU without SIMD, such as "closest hits"; empty if all bits of the
/// digest's answers and trees are equal. "denormals" if only those do. Throws Error.
std::string find_difference(const Device& tested);

/// Runs the test with all kernels, and keeps the result. Throws Error(limit).
DeviceCheck run_self_test(const mray::gpu::DeviceInfo& info);
/// The result that is kept for this device, driver and version of the library, if there is one.
std::optional<DeviceCheck> kept_check(const mray::gpu::DeviceInfo& info);
/// Keeps and returns a failure.
DeviceCheck keep_failure(const mray::gpu::DeviceInfo& info, ErrorCode code,
                         const std::string& what);

}  // namespace morphray::detail
