// Which device of Vulkan is used, and what is known of it.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

namespace mray::gpu {

/// A device that the caller has made and may go on using. The handles are those of Vulkan.
struct HostDevice {
    void* instance = nullptr;
    void* physical_device = nullptr;
    void* device = nullptr;
    void* queue = nullptr;
    std::uint32_t queue_family = 0;
    /// vkGetInstanceProcAddr of the loader that made the instance; null: libvulkan's.
    void* get_instance_proc_addr = nullptr;
    /// Called around each use of the queue.
    std::function<void()> lock_queue;
    std::function<void()> unlock_queue;
};

struct VulkanConfig {
    /// An index of list_devices(), a part of the name of one device only, or a UUID (32 hex digits,
    /// dashes ignored). Empty: the first usable device, discrete before integrated, virtual, CPU.
    std::string device;
    /// Enables the Khronos validation layer (core, synchronisation). A call that causes a message
    /// of error severity throws Error(kInternal).
    bool validate = false;
    /// If set, the device to use instead of one of our own; `device` and `validate` do not count.
    std::shared_ptr<const HostDevice> host = nullptr;
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

}  // namespace mray::gpu
