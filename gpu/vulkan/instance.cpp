#include "gpu/vulkan/instance.h"

#include <algorithm>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "gpu/vulkan/result.h"

namespace mray::gpu {
namespace {

constexpr const char* kValidationLayer = "VK_LAYER_KHRONOS_validation";

[[noreturn]] void unavailable(const std::string& text) {
    throw Error(ErrorKind::kUnavailable, "Vulkan: " + text);
}

/// A loader reports these two, at the first call, for a driver that it cannot start and, as version
/// 1.3.239 does and 1.4.309 does not, for a manifest that it cannot parse.
void check_loader(VkResult result, const char* action) {
    const bool has_memory = result != VK_ERROR_OUT_OF_HOST_MEMORY;
    if (!has_memory || result == VK_ERROR_INITIALIZATION_FAILED) {
        unavailable(std::string(has_memory ? "" : "memory ran out, or ") +
                    "a driver on this machine is broken: it cannot be started, or its manifest "
                    "cannot be read (" +
                    result_name(result) + "); see VK_DRIVER_FILES and VK_ICD_FILENAMES");
    }
    check(result, action);
}

void load_library(PFN_vkGetInstanceProcAddr loader) {
    if (loader != nullptr) {
        volkInitializeCustom(loader);
    } else if (volkInitialize() != VK_SUCCESS) {
        unavailable("no Vulkan library (libvulkan.so.1) on this machine; install libvulkan1");
    }
    // Missing in loaders of Vulkan 1.0.
    std::uint32_t version = VK_API_VERSION_1_0;
    if (vkEnumerateInstanceVersion != nullptr) {
        check_loader(vkEnumerateInstanceVersion(&version), "query the instance version");
    }
    if (version < VK_API_VERSION_1_1) {
        unavailable("the Vulkan library on this machine is older than 1.1; install a newer one");
    }
}

/// Fills volk's pointers, through which other threads may be calling, unless they are those of this
/// loader: they serve all of its instances and devices, so volkLoadInstance, not volkLoadDevice.
/// Instances without debug utils do not know the functions of these.
void load_functions(VkInstance instance, bool has_debug_utils) {
    const auto find = [&]<class Function>(const char* name, Function) {
        return reinterpret_cast<Function>(vkGetInstanceProcAddr(instance, name));
    };
    if (vkCreateDevice != find("vkCreateDevice", vkCreateDevice) ||
        vkQueueSubmit != find("vkQueueSubmit", vkQueueSubmit))
        volkLoadInstance(instance);
    if (!has_debug_utils || vkCreateDebugUtilsMessengerEXT != nullptr) return;
    vkDestroyDebugUtilsMessengerEXT =
        find("vkDestroyDebugUtilsMessengerEXT", vkDestroyDebugUtilsMessengerEXT);
    vkCreateDebugUtilsMessengerEXT =
        find("vkCreateDebugUtilsMessengerEXT", vkCreateDebugUtilsMessengerEXT);
}

/// Whether `list`, a function of the loader, lists an item of this name.
template <class Item, class List>
bool lists(char (Item::*name)[VK_MAX_EXTENSION_NAME_SIZE], const char* wanted, const char* action,
           List list) {
    std::vector<Item> items;
    check_loader(read_list(items, list), action);
    return std::ranges::any_of(
        items, [&](const Item& item) { return std::strcmp(item.*name, wanted) == 0; });
}

bool has_extension(const char* name) {
    return lists(&VkExtensionProperties::extensionName, name, "list instance extensions",
                 [](std::uint32_t* count, VkExtensionProperties* items) {
                     return vkEnumerateInstanceExtensionProperties(nullptr, count, items);
                 });
}

bool has_layer(const char* name) {
    return lists(&VkLayerProperties::layerName, name, "list instance layers",
                 vkEnumerateInstanceLayerProperties);
}

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

VkInstance create_instance(const VkInstanceCreateInfo& info) {
    VkInstance instance = VK_NULL_HANDLE;
    std::unique_lock lock(loader_mutex());
    const VkResult result = vkCreateInstance(&info, nullptr, &instance);
    lock.unlock();
    if (result == VK_ERROR_INCOMPATIBLE_DRIVER) {
        unavailable(
            "no driver on this machine, or none whose manifest can be read "
            "(VK_ERROR_INCOMPATIBLE_DRIVER); install one, for example mesa-vulkan-drivers, or see "
            "VK_DRIVER_FILES and VK_ICD_FILENAMES");
    }
    check_loader(result, "create an instance");
    return instance;
}

void destroy_instance(VkInstance instance) {
    const std::scoped_lock lock(loader_mutex());
    vkDestroyInstance(instance, nullptr);
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

std::mutex& loader_mutex() {
    static std::mutex mutex;
    return mutex;
}

Instance::Instance(bool validate, PFN_vkGetInstanceProcAddr loader, ValidationLog* log)
    : log_(log != nullptr ? *log : own_log_) {
    load_library(loader);
    std::vector<const char*> extensions;
    const bool has_debug_utils = has_extension(VK_EXT_DEBUG_UTILS_EXTENSION_NAME);
    if (has_debug_utils) extensions.push_back(VK_EXT_DEBUG_UTILS_EXTENSION_NAME);
    if (validate && !(has_layer(kValidationLayer) && has_debug_utils)) {
        unavailable("validation was asked for, but " + std::string(kValidationLayer) +
                    " is not installed; install vulkan-validationlayers");
    }

    const VkApplicationInfo application = {
        .sType = VK_STRUCTURE_TYPE_APPLICATION_INFO,
        .pApplicationName = "morphray",
        .apiVersion = VK_API_VERSION_1_2,
    };
    VkDebugUtilsMessengerCreateInfoEXT messenger = log_.messenger_info();
    // The messenger in the chain receives messages from creation and destruction of the instance.
    const VkValidationFeatureEnableEXT enabled[] = {
        VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT,
    };
    const void* chain = &messenger;
#ifdef VK_EXT_layer_settings
    // Layers that have settings look into shaders, and find missing barriers between them, only if
    // asked.
    const VkBool32 is_on = VK_TRUE;
    const VkLayerSettingEXT setting = {.pLayerName = kValidationLayer,
                                       .pSettingName = "syncval_shader_accesses_heuristic",
                                       .type = VK_LAYER_SETTING_TYPE_BOOL32_EXT,
                                       .valueCount = 1,
                                       .pValues = &is_on};
    const VkLayerSettingsCreateInfoEXT settings = {
        .sType = VK_STRUCTURE_TYPE_LAYER_SETTINGS_CREATE_INFO_EXT,
        .pNext = chain,
        .settingCount = 1,
        .pSettings = &setting,
    };
    chain = &settings;
#endif
    const VkValidationFeaturesEXT features = {
        .sType = VK_STRUCTURE_TYPE_VALIDATION_FEATURES_EXT,
        .pNext = chain,
        .enabledValidationFeatureCount = 1,
        .pEnabledValidationFeatures = enabled,
    };
    handle_ = create_instance({
        .sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO,
        .pNext = validate ? &features : nullptr,
        .pApplicationInfo = &application,
        .enabledLayerCount = validate ? 1u : 0u,
        .ppEnabledLayerNames = &kValidationLayer,
        .enabledExtensionCount = static_cast<std::uint32_t>(extensions.size()),
        .ppEnabledExtensionNames = extensions.data(),
    });
    load_functions(handle_, has_debug_utils);
    if (has_debug_utils) {
        set_name_ = reinterpret_cast<PFN_vkSetDebugUtilsObjectNameEXT>(
            vkGetInstanceProcAddr(handle_, "vkSetDebugUtilsObjectNameEXT"));
    }
    if (!validate) return;
    VkDebugUtilsMessengerEXT created = VK_NULL_HANDLE;
    const VkResult result = vkCreateDebugUtilsMessengerEXT(handle_, &messenger, nullptr, &created);
    if (result != VK_SUCCESS) {
        destroy_instance(handle_);
        throw_result(result, "create the validation messenger");
    }
    messenger_ = UniqueMessenger(handle_, created);
}

Instance::Instance(VkInstance host, PFN_vkGetInstanceProcAddr loader)
    : log_(own_log_), handle_(host), is_own_(false) {
    load_library(loader);
    load_functions(handle_, false);
}

Instance::~Instance() {
    messenger_ = UniqueMessenger();
    if (is_own_) destroy_instance(handle_);
}

}  // namespace mray::gpu
