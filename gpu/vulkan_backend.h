// The Vulkan device behind the seam.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "common/backend.h"

namespace morphray::gpu {

struct VulkanConfig {
    /// An index of list_devices(), a part of a name that fits one device only, or a UUID (32 hex
    /// digits, dashes ignored). Empty: the first discrete, then integrated, virtual, CPU device
    /// that fits.
    std::string device;
    /// Asks for the Khronos validation layer (core, synchronisation); any message of error severity
    /// makes the call that caused it throw Error(kInternal).
    bool validate = false;
};

struct DeviceInfo {
    std::uint32_t index = 0;
    std::string name;
    std::string type;
    std::string driver;
    std::string uuid;
    std::uint32_t api_major = 0;
    std::uint32_t api_minor = 0;
    std::uint64_t memory_bytes = 0;
    std::uint32_t subgroup_size = 0;
    /// Empty if morphray can run there; otherwise what it lacks.
    std::string unusable;
};

/// Throws Error(kUnavailable) with its own text for: no Vulkan loader, no driver, a broken driver.
std::vector<DeviceInfo> list_devices();

/// Throws Error(kUnavailable) as above and for: no such device, an ambiguous name, a device that
/// lacks what is needed, validation asked for but not installed.
std::unique_ptr<Backend> make_vulkan_backend(const VulkanConfig& config = {});

}  // namespace morphray::gpu
