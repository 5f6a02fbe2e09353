#include "gpu/vulkan/validation_log.h"

#include <utility>

#include "common/base/errors.h"

namespace mray::gpu {
namespace {

VKAPI_ATTR VkBool32 VKAPI_CALL on_message(VkDebugUtilsMessageSeverityFlagBitsEXT,
                                          VkDebugUtilsMessageTypeFlagsEXT,
                                          const VkDebugUtilsMessengerCallbackDataEXT* data,
                                          void* user_data) {
    std::string text = data->pMessage != nullptr ? data->pMessage : "(no text)";
    // Some versions of the layer leave the name of the rule out of the text.
    const char* rule = data->pMessageIdName;
    if (rule != nullptr && text.find(rule) == std::string::npos)
        text = std::string(rule) + ": " + text;
    static_cast<ValidationLog*>(user_data)->add(std::move(text));
    return VK_FALSE;
}

}  // namespace

void ValidationLog::add(std::string message) {
    const std::lock_guard lock(mutex_);
    messages_.push_back(std::move(message));
}

std::size_t ValidationLog::size() const {
    const std::lock_guard lock(mutex_);
    return messages_.size();
}

std::vector<std::string> ValidationLog::messages() const {
    const std::lock_guard lock(mutex_);
    return messages_;
}

void ValidationLog::throw_if_new() {
    const std::lock_guard lock(mutex_);
    if (reported_ == messages_.size()) return;
    const std::string& first = messages_[reported_];
    const std::size_t count = messages_.size() - reported_;
    reported_ = messages_.size();
    throw Error(ErrorKind::kInternal,
                "Vulkan validation: " + std::to_string(count) + " error(s), the first: " + first);
}

VkDebugUtilsMessengerCreateInfoEXT ValidationLog::messenger_info() {
    return {
        .sType = VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT,
        .messageSeverity = VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT,
        .messageType = VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT,
        .pfnUserCallback = on_message,
        .pUserData = this,
    };
}

}  // namespace mray::gpu
