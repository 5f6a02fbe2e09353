// From VkResult to Error.
#pragma once

#include <string>

#include "common/base/errors.h"
#include "gpu/vulkan/vulkan_api.h"

namespace morphray::gpu {

/// "VK_ERROR_DEVICE_LOST", or the number of a result that is not known here.
std::string result_name(VkResult result);

/// kLimit for exhausted memory, kDeviceLost for a lost device and a timeout, kUnavailable for what
/// the device or driver does not have, kInternal for the rest.
ErrorKind error_kind_of(VkResult result);

[[noreturn]] void throw_result(VkResult result, const char* action);

/// Throws Error("cannot <action>: <result>") unless the result is VK_SUCCESS.
inline void check(VkResult result, const char* action) {
    if (result != VK_SUCCESS) throw_result(result, action);
}

}  // namespace morphray::gpu
