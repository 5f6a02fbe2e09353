// A device, its queue, and work submitted to it one batch at a time.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <type_traits>

#include "gpu/device_info.h"
#include "gpu/instance.h"
#include "gpu/tuning.h"
#include "gpu/unique_handle.h"

namespace morphray::gpu {

class Context {
public:
    /// Throws Error as make_vulkan_backend.
    Context(const VulkanConfig& config, const Tuning& tuning);

    VkDevice device() const { return device_.get(); }
    const PhysicalDevice& physical() const { return physical_; }
    const VkPhysicalDeviceLimits& limits() const { return physical_.limits; }
    bool force_staging() const { return tuning_.force_staging; }

    /// Records, submits and waits; returns the time on the device in milliseconds (or that of the
    /// wait where it has no timestamps). What earlier submissions wrote is visible to the commands,
    /// and what the commands write is visible to the host. Throws Error(kDeviceLost) when the
    /// device is lost or does not finish in time, and Error(kInternal) when the validation layer
    /// reported an error.
    double submit(const char* what, const std::function<void(VkCommandBuffer)>& record);

    /// Names an object for debuggers and validation messages.
    template <class Handle>
    void name(VkObjectType type, Handle handle, const std::string& text) {
        // Non-dispatchable handles are pointers on 64-bit machines and integers elsewhere.
        if constexpr (std::is_pointer_v<Handle>) {
            name_object(type, reinterpret_cast<std::uintptr_t>(handle), text);
        } else {
            name_object(type, handle, text);
        }
    }

    /// Throws Error(kInternal) if the validation layer reported an error since the last call.
    void throw_on_validation_errors() { log_.throw_if_new(); }

private:
    /// Destroyed only after all its work is done: also after an error in the middle of it.
    class Device {
    public:
        explicit Device(VkDevice handle) : handle_(handle) {}
        Device(const Device&) = delete;
        Device& operator=(const Device&) = delete;
        ~Device() { vkDestroyDevice(handle_, nullptr); }
        VkDevice get() const { return handle_; }

    private:
        VkDevice handle_;
    };

    void name_object(VkObjectType type, std::uint64_t handle, const std::string& text);
    void wait(const char* what);
    double device_ms() const;

    Tuning tuning_;
    ValidationLog own_log_;
    ValidationLog& log_;
    Instance instance_;
    PhysicalDevice physical_;
    Device device_;
    VkQueue queue_ = VK_NULL_HANDLE;
    UniqueCommandPool pool_;
    VkCommandBuffer commands_ = VK_NULL_HANDLE;
    UniqueFence fence_;
    UniqueQueryPool queries_;
};

/// One dependency between what is recorded before and after.
void barrier(VkCommandBuffer commands, VkPipelineStageFlags from_stage, VkAccessFlags from,
             VkPipelineStageFlags to_stage, VkAccessFlags to);

}  // namespace morphray::gpu
