#include "gpu/vulkan/instance.h"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstring>
#include <utility>

#include "gpu/vulkan/result.h"

namespace mray::gpu {
namespace {

constexpr const char* kValidationLayer = "VK_LAYER_KHRONOS_validation";

/// The process that has made an instance.
std::atomic<::pid_t> driver_process = 0;

/// A loader reports these two, at the first call, for a driver that it cannot start and, as version
/// 1.3.239 does and 1.4.309 does not, for a manifest that it cannot parse.
void check_loader(VkResult result, const char* action) {
    const bool has_memory = result != VK_ERROR_OUT_OF_HOST_MEMORY;
    if (!has_memory || result == VK_ERROR_INITIALIZATION_FAILED) {
        throw_unavailable(
            std::string(has_memory ? "" : "memory ran out, or ") +
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
        throw_unavailable("no Vulkan library (libvulkan.so.1) on this machine; install libvulkan1");
    }
    // Missing in loaders of Vulkan 1.0.
    if (vkEnumerateInstanceVersion == nullptr)
        throw_unavailable(
            "the Vulkan library on this machine is older than 1.1; install a newer one");
}

template <class Function>
Function function_of(VkInstance instance, const char* name) {
    return reinterpret_cast<Function>(vkGetInstanceProcAddr(instance, name));
}

/// Fills volk's pointers, through which other threads may be calling, unless they are those of this
/// loader: they serve all of its instances and devices, so volkLoadInstance, not volkLoadDevice.
void load_functions(VkInstance instance) {
    if (vkCreateDevice != function_of<PFN_vkCreateDevice>(instance, "vkCreateDevice") ||
        vkQueueSubmit != function_of<PFN_vkQueueSubmit>(instance, "vkQueueSubmit"))
        volkLoadInstance(instance);
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
    const VkResult result = vkCreateInstance(&info, nullptr, &instance);
    if (result == VK_ERROR_INCOMPATIBLE_DRIVER) {
        throw_unavailable(
            "no driver on this machine, or none that loads: its manifest can be damaged, or the "
            "library that it names missing (VK_ERROR_INCOMPATIBLE_DRIVER); install one, for "
            "example mesa-vulkan-drivers, or see VK_DRIVER_FILES and VK_ICD_FILENAMES");
    }
    check_loader(result, "create an instance");
    return instance;
}

}  // namespace

bool is_forked() { return driver_process != 0 && driver_process != ::getpid(); }

void throw_if_forked() {
    if (is_forked())
        throw_unavailable("it does not survive a fork; start processes by spawn or exec");
}

void ValidationLog::add(std::string message) {
    const std::lock_guard lock(mutex_);
    messages_.push_back(std::move(message));
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

Instance::Instance(bool validate, PFN_vkGetInstanceProcAddr loader, ValidationLog* log)
    : log_(log != nullptr ? *log : own_log_) {
    load_library(loader);
    driver_process = ::getpid();
    if (validate &&
        !(has_layer(kValidationLayer) && has_extension(VK_EXT_DEBUG_UTILS_EXTENSION_NAME))) {
        throw_unavailable("validation was asked for, but " + std::string(kValidationLayer) +
                          " is not installed; install vulkan-validationlayers");
    }

    const VkApplicationInfo application = {
        .sType = VK_STRUCTURE_TYPE_APPLICATION_INFO,
        .pApplicationName = "morphray",
        .apiVersion = VK_API_VERSION_1_2,
    };
    const VkDebugUtilsMessengerCreateInfoEXT messenger = log_.messenger_info();
    // The messenger in the chain receives messages from creation and destruction of the instance.
    const VkValidationFeatureEnableEXT enabled[] = {
        VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT,
    };
    const void* chain = &messenger;
#ifdef VK_EXT_layer_settings
    // Layers with settings look for missing barriers between shaders only if asked.
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
    const char* const extension = VK_EXT_DEBUG_UTILS_EXTENSION_NAME;
    handle_ = create_instance({
        .sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO,
        .pNext = validate ? &features : nullptr,
        .pApplicationInfo = &application,
        .enabledLayerCount = validate ? 1u : 0u,
        .ppEnabledLayerNames = &kValidationLayer,
        .enabledExtensionCount = validate ? 1u : 0u,
        .ppEnabledExtensionNames = &extension,
    });
    load_functions(handle_);
    if (!validate) return;
    // Those of this instance: volk's pointers may come to be those of one without debug utils.
    const auto create =
        function_of<PFN_vkCreateDebugUtilsMessengerEXT>(handle_, "vkCreateDebugUtilsMessengerEXT");
    destroy_messenger_ = function_of<PFN_vkDestroyDebugUtilsMessengerEXT>(
        handle_, "vkDestroyDebugUtilsMessengerEXT");
    const VkResult result = create(handle_, &messenger, nullptr, &messenger_);
    if (result == VK_SUCCESS) return;
    vkDestroyInstance(handle_, nullptr);
    throw_result(result, "create the validation messenger");
}

Instance::~Instance() {
    if (is_forked()) return;
    if (messenger_ != VK_NULL_HANDLE) destroy_messenger_(handle_, messenger_, nullptr);
    vkDestroyInstance(handle_, nullptr);
}

}  // namespace mray::gpu
