// The backend of a Vulkan device.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "common/backend.h"

namespace mray::gpu {

struct VulkanConfig {
    /// An index of list_devices(), a part of the name of one device only, or a UUID (32 hex digits,
    /// dashes ignored). Empty: the first usable device, discrete before integrated, virtual, CPU.
    std::string device;
    /// Enables the Khronos validation layer (core, synchronisation). A call that causes a message
    /// of error severity throws Error(kInternal).
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
    /// Empty if morphray can use the device; otherwise the features that it lacks.
    std::string unusable;
};

/// Throws Error(kUnavailable), with a text for each cause: no Vulkan loader, no driver, a broken
/// driver.
std::vector<DeviceInfo> list_devices();

/// Throws Error(kUnavailable) as list_devices(), and for: no such device, an ambiguous name, a
/// device that lacks a feature, a validation layer that is not installed.
std::unique_ptr<Backend> make_vulkan_backend(const VulkanConfig& config = {});

}  // namespace mray::gpu
