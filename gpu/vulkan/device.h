// A device with its queue and its memory, which all backends on it share.
#pragma once

#include <atomic>
#include <memory>
#include <mutex>

#include "gpu/vulkan/device_info.h"
#include "gpu/vulkan/instance.h"
#include "gpu/vulkan/memory.h"
#include "gpu/vulkan/unique_handle.h"

namespace mray::gpu {

/// Threads may share it. Objects made of it must not outlive it.
class Device {
public:
    /// Throws Error as make_vulkan_backend().
    Device(std::shared_ptr<Instance> instance, PhysicalDevice physical, bool force_staging);
    ~Device();
    Device(const Device&) = delete;
    Device& operator=(const Device&) = delete;

    VkDevice get() const { return handle_; }
    const PhysicalDevice& physical() const { return physical_; }
    const VkPhysicalDeviceLimits& limits() const { return physical_.limits; }

    /// Submits commands, one thread at a time. Throws Error.
    void submit(const VkSubmitInfo& submission, VkFence fence);

    void finish() noexcept;

    /// Whether work on it failed for good. It is not used for new scenes.
    bool is_lost() const { return is_lost_; }
    void set_lost() { is_lost_ = true; }
    /// set_lost() for a device that does not answer: nothing of it is ever destroyed, since it may
    /// still write to its memory.
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
