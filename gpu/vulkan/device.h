// The Vulkan instance, the machine's devices, and a device with its queue and memory.
#pragma once

#include <atomic>
#include <memory>
#include <mutex>

#include "gpu/vulkan/memory.h"

namespace mray::gpu {

/// Collects messages of error severity, from any thread.
class ValidationLog {
public:
    void add(std::string message);
    std::vector<std::string> messages() const;
    /// Throws Error(kInternal) with the first message since the last call that threw.
    void throw_if_new();

    /// For vkCreateDebugUtilsMessengerEXT; must outlive the messenger.
    VkDebugUtilsMessengerCreateInfoEXT messenger_info();

private:
    mutable std::mutex mutex_;
    std::vector<std::string> messages_;
    std::size_t reported_ = 0;
};

/// Throws if a parent process made an instance before it forked: calls may wait for lost threads.
void throw_if_forked();

/// Owns a VkInstance and, with validation, the messenger that fills its log. Constructors fill
/// volk's global pointers, one thread at a time; others may call meanwhile.
class Instance {
public:
    /// Throws Error(kUnavailable), with a text for each cause: no Vulkan library, one older than
    /// 1.1, no driver that starts, no validation layer although `validate` is set. Messages of
    /// validation go to `log`, if there is one; it must outlive this.
    Instance(bool validate, PFN_vkGetInstanceProcAddr loader, ValidationLog* log = nullptr);
    ~Instance();
    Instance(const Instance&) = delete;
    Instance& operator=(const Instance&) = delete;

    VkInstance get() const { return handle_; }
    ValidationLog& log() { return log_; }

private:
    ValidationLog own_log_;
    ValidationLog& log_;
    VkInstance handle_ = VK_NULL_HANDLE;
    VkDebugUtilsMessengerEXT messenger_ = VK_NULL_HANDLE;
    PFN_vkDestroyDebugUtilsMessengerEXT destroy_messenger_ = nullptr;
};

/// A device as Vulkan describes it. If it is not usable, only `handle` and `info` are valid.
struct PhysicalDevice {
    VkPhysicalDevice handle = VK_NULL_HANDLE;
    DeviceInfo info;
    VkPhysicalDeviceLimits limits = {};
    VkPhysicalDeviceMemoryProperties memory = {};
    VkDeviceSize max_allocation = 0;
    std::uint32_t queue_family = 0;
    std::uint32_t timestamp_bits = 0;  // 0: no timestamps
};

/// All devices in the loader's order. Throws Error(kUnavailable) if there is none.
std::vector<PhysicalDevice> physical_devices(const Instance& instance);

/// The index of the device that `wanted` names (VulkanConfig::device). Throws Error(kUnavailable),
/// with the list of devices, if there is none, more than one, or if it is not usable.
std::size_t choose_device(std::span<const DeviceInfo> devices, const std::string& wanted);

/// A device with its queue and memory, which threads may share, and which outlives its objects.
class Device {
public:
    Device(std::shared_ptr<Instance> instance, PhysicalDevice physical, bool force_staging);
    ~Device();
    Device(const Device&) = delete;
    Device& operator=(const Device&) = delete;

    VkDevice get() const { return handle_; }
    const PhysicalDevice& physical() const { return physical_; }

    /// Submits commands, one thread at a time.
    void submit(const VkSubmitInfo& submission, VkFence fence);

    void finish() noexcept;

    /// Whether work on it failed for good: it is not used for new scenes.
    bool is_lost() const { return is_lost_; }
    void set_lost() { is_lost_ = true; }
    /// set_lost() for a device that does not answer: it may still write, so nothing is destroyed.
    void give_up();

    MemoryBlocks& memory() { return memory_; }
    /// Whether copies go through a staging buffer even if the host sees the device's memory.
    bool force_staging() const { return force_staging_; }

    /// Throws Error(kInternal) if the validation layer reported an error since the last call.
    void throw_on_validation_errors() { instance_->log().throw_if_new(); }

private:
    std::shared_ptr<Instance> instance_;
    PhysicalDevice physical_;
    bool force_staging_;
    VkDevice handle_ = VK_NULL_HANDLE;
    VkQueue queue_ = VK_NULL_HANDLE;
    std::mutex queue_mutex_;
    std::atomic<bool> is_lost_ = false;
    MemoryBlocks memory_;
};

}  // namespace mray::gpu
