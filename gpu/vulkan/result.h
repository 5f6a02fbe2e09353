// Converts VkResult to Error.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/base/errors.h"
#include "gpu/vulkan/vulkan_api.h"

namespace mray::gpu {

/// The name of a result, such as "VK_ERROR_DEVICE_LOST", or its number if it is unknown.
std::string result_name(VkResult result);

/// kLimit for exhausted memory, kDeviceLost for a lost device and a timeout, kUnavailable for
/// missing features, extensions and layers, kInternal for the rest.
ErrorKind error_kind_of(VkResult result);

/// Throws Error(kUnavailable, "Vulkan: <text>"), or kLimit if a driver finds no memory to start.
[[noreturn]] void throw_unavailable(const std::string& text);

[[noreturn]] void throw_result(VkResult result, const char* action);

/// Throws Error("cannot <action>: <result>") if the result is not VK_SUCCESS.
inline void check(VkResult result, const char* action) {
    if (result != VK_SUCCESS) throw_result(result, action);
}

/// Sets `items` to those of `list(&count, items)`, which takes null for their number.
template <class Item, class List>
VkResult read_list(std::vector<Item>& items, List list) {
    std::uint32_t count = 0;
    const VkResult result = list(&count, nullptr);
    if (result != VK_SUCCESS) return result;
    items.resize(count);
    return list(&count, items.data());
}

}  // namespace mray::gpu
