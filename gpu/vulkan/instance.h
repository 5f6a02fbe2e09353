// The Vulkan instance, and the messages of its validation layer.
#pragma once

#include <mutex>
#include <string>
#include <vector>

#include "gpu/vulkan/vulkan_api.h"
#include "gpu/vulkan/vulkan_config.h"

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

/// Whether a parent had made an instance before it forked: calls may wait for threads of its
/// driver.
bool is_forked();
void throw_if_forked();

/// Owns a VkInstance and, with validation, the messenger that fills its log. Constructors fill
/// volk's global pointers, one thread at a time; others may call meanwhile.
class Instance {
public:
    /// Throws Error(kUnavailable), with a text for each cause: no Vulkan library, a library older
    /// than 1.1, no driver, a broken driver, no validation layer although `validate` is set.
    /// Messages of validation go to `log`, if there is one; it must outlive this.
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

}  // namespace mray::gpu
