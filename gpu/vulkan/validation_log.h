// The messages of the validation layer.
#pragma once

#include <mutex>
#include <string>
#include <vector>

#include "gpu/vulkan/vulkan_api.h"

namespace mray::gpu {

/// Collects messages of error severity, from any thread.
class ValidationLog {
public:
    void add(std::string message);
    /// The number of messages so far.
    std::size_t size() const;
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

}  // namespace mray::gpu
