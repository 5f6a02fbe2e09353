#include "gpu/vulkan/device.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <map>

#include "common/text/text.h"

namespace mray::gpu {
namespace {

constexpr const char* kValidationLayer = "VK_LAYER_KHRONOS_validation";

/// The process that has made an instance.
std::atomic<::pid_t> driver_process = 0;

bool is_forked() { return driver_process != 0 && driver_process != ::getpid(); }

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

/// Fills volk's pointers, which other threads may be using, unless they are from this loader. They
/// serve all of its instances and devices, so volkLoadInstance, not volkLoadDevice.
void load_functions(VkInstance instance) {
    if (vkCreateDevice != function_of<PFN_vkCreateDevice>(instance, "vkCreateDevice") ||
        vkQueueSubmit != function_of<PFN_vkQueueSubmit>(instance, "vkQueueSubmit"))
        volkLoadInstance(instance);
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
    // Loader 1.3.239 gives the others for a driver that fails, or a manifest that it cannot parse.
    if (result == VK_ERROR_INCOMPATIBLE_DRIVER || result == VK_ERROR_INITIALIZATION_FAILED ||
        result == VK_ERROR_OUT_OF_HOST_MEMORY) {
        throw_unavailable(
            "no driver on this machine, or none that loads: its manifest can be damaged, or the "
            "library that it names missing (" +
            result_name(result) +
            "); install one, for example mesa-vulkan-drivers, or see VK_DRIVER_FILES and "
            "VK_ICD_FILENAMES");
    }
    if (info.enabledLayerCount > 0 &&
        (result == VK_ERROR_LAYER_NOT_PRESENT || result == VK_ERROR_EXTENSION_NOT_PRESENT)) {
        throw_unavailable("validation was asked for, but " + std::string(kValidationLayer) +
                          " is not installed; install vulkan-validationlayers");
    }
    check(result, "create an instance");
    return instance;
}

/// The preferred first.
constexpr std::pair<VkPhysicalDeviceType, const char*> kDeviceTypes[] = {
    {VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU, "discrete"},
    {VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU, "integrated"},
    {VK_PHYSICAL_DEVICE_TYPE_VIRTUAL_GPU, "virtual"},
    {VK_PHYSICAL_DEVICE_TYPE_CPU, "cpu"},
};

const char* type_name(VkPhysicalDeviceType type) {
    for (const auto& [value, name] : kDeviceTypes) {
        if (value == type) return name;
    }
    return "other";
}

/// Whether lavapipe was told to use vectors of an unusual width. Mesa 25.0.7, unlike 22.3.6, then
/// crashes (4 lanes: misaligned stores) or gives wrong results (16 lanes, by LLVM's optimiser).
bool has_unsound_width(const VkPhysicalDeviceDriverProperties& driver,
                       std::uint32_t subgroup_size) {
    // Lavapipe's version number is always 1.
    unsigned mesa = 0;
    return driver.driverID == VK_DRIVER_ID_MESA_LLVMPIPE && subgroup_size != 8 &&
           std::getenv("LP_NATIVE_VECTOR_WIDTH") != nullptr &&
           std::sscanf(driver.driverInfo, "Mesa %u", &mesa) == 1 && mesa > 22;
}

/// Reads the properties of Vulkan 1.1. Returns the reason why the device is unusable, or nothing.
std::string describe_1_1(PhysicalDevice& device) {
    VkPhysicalDeviceFloatControlsProperties floats = {
        .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FLOAT_CONTROLS_PROPERTIES};
    VkPhysicalDeviceDriverProperties driver = {
        .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_DRIVER_PROPERTIES};
    VkPhysicalDeviceMaintenance3Properties maintenance = {
        .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_MAINTENANCE_3_PROPERTIES};
    VkPhysicalDeviceSubgroupProperties subgroup = {
        .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_SUBGROUP_PROPERTIES, .pNext = &maintenance};
    VkPhysicalDeviceIDProperties id = {.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_ID_PROPERTIES,
                                       .pNext = &subgroup};
    // Vulkan 1.1 tells neither: then kernels demand nothing of floats.
    const bool is_1_2 = device.info.api_major > 1 || device.info.api_minor >= 2;
    if (is_1_2) {
        driver.pNext = std::exchange(id.pNext, &driver);
        floats.pNext = std::exchange(id.pNext, &floats);
    }
    VkPhysicalDeviceProperties2 properties = {
        .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2, .pNext = &id};
    vkGetPhysicalDeviceProperties2(device.handle, &properties);

    device.limits = properties.properties.limits;
    device.max_allocation = maintenance.maxMemoryAllocationSize;
    device.info.uuid = fmt::format("{:02x}", fmt::join(id.deviceUUID, ""));
    device.info.subgroup_size = subgroup.subgroupSize;
    device.info.prefers_texels = driver.driverID == VK_DRIVER_ID_MESA_LLVMPIPE;
    if (is_1_2) device.info.driver = fmt::format("{} {}", driver.driverName, driver.driverInfo);
    if (has_unsound_width(driver, subgroup.subgroupSize)) {
        return "it crashes or gives wrong results with such a width of vectors; unset "
               "LP_NATIVE_VECTOR_WIDTH";
    }
    device.info.promises_floats = floats.shaderRoundingModeRTEFloat32 == VK_TRUE &&
                                  floats.shaderSignedZeroInfNanPreserveFloat32 == VK_TRUE;
    return "";
}

/// Finds a compute queue, without graphics if there is one: that runs undisturbed.
std::string find_queue(PhysicalDevice& device) {
    std::uint32_t count = 0;
    vkGetPhysicalDeviceQueueFamilyProperties(device.handle, &count, nullptr);
    std::vector<VkQueueFamilyProperties> families(count);
    vkGetPhysicalDeviceQueueFamilyProperties(device.handle, &count, families.data());
    const auto find = [&](VkQueueFlags flags, VkQueueFlags wanted) {
        return std::ranges::find_if(families, [=](const auto& family) {
            return family.queueCount > 0 && (family.queueFlags & flags) == wanted;
        });
    };
    auto family = find(VK_QUEUE_COMPUTE_BIT | VK_QUEUE_GRAPHICS_BIT, VK_QUEUE_COMPUTE_BIT);
    if (family == families.end()) family = find(VK_QUEUE_COMPUTE_BIT, VK_QUEUE_COMPUTE_BIT);
    if (family == families.end()) return "it has no compute queue";
    device.queue_family = static_cast<std::uint32_t>(family - families.begin());
    device.timestamp_bits = family->timestampValidBits;
    return "";
}

PhysicalDevice describe(VkPhysicalDevice handle, std::uint32_t index) {
    PhysicalDevice device;
    device.handle = handle;
    VkPhysicalDeviceProperties properties = {};
    vkGetPhysicalDeviceProperties(handle, &properties);
    vkGetPhysicalDeviceMemoryProperties(handle, &device.memory);
    device.info.index = index;
    device.info.name = properties.deviceName;
    device.info.type = type_name(properties.deviceType);
    device.info.api_major = VK_API_VERSION_MAJOR(properties.apiVersion);
    device.info.api_minor = VK_API_VERSION_MINOR(properties.apiVersion);
    for (std::uint32_t i = 0; i < device.memory.memoryHeapCount; ++i) {
        const VkMemoryHeap& heap = device.memory.memoryHeaps[i];
        if ((heap.flags & VK_MEMORY_HEAP_DEVICE_LOCAL_BIT) == 0) continue;
        device.info.memory_bytes = std::max<std::uint64_t>(device.info.memory_bytes, heap.size);
    }
    if (properties.apiVersion < VK_API_VERSION_1_1) {
        device.info.unusable = "it has only Vulkan 1.0; 1.1 is needed";
        return device;
    }
    device.info.unusable = describe_1_1(device);
    if (device.info.unusable.empty()) device.info.unusable = find_queue(device);
    return device;
}

std::string listing(std::span<const DeviceInfo> devices) {
    std::string text;
    for (const DeviceInfo& d : devices) {
        text += fmt::format("{}{}: {}{}", text.empty() ? "" : ", ", d.index, d.name,
                            d.unusable.empty() ? "" : " (unusable)");
    }
    return text;
}

auto rank(const DeviceInfo& device) {
    return std::ranges::find(kDeviceTypes, device.type,
                             [](const auto& type) { return std::string_view(type.second); }) -
           kDeviceTypes;
}

std::size_t preferred_device(std::span<const DeviceInfo> devices) {
    const auto best = std::ranges::min_element(devices, {}, [](const DeviceInfo& device) {
        return std::pair(!device.unusable.empty(), rank(device));
    });
    if (best->unusable.empty()) return static_cast<std::size_t>(best - devices.begin());
    std::string text = "Vulkan: no usable device: ";
    for (const DeviceInfo& d : devices) text += fmt::format("{}: {}; ", d.name, d.unusable);
    throw Error(ErrorKind::kUnavailable, text + "use the CPU backend");
}

std::vector<std::size_t> matches(std::span<const DeviceInfo> devices, const std::string& wanted) {
    std::vector<std::size_t> found;
    const std::string part = lower_case(wanted);
    std::string uuid = part;
    std::erase(uuid, '-');
    for (std::size_t i = 0; i < devices.size(); ++i) {
        if (devices[i].uuid == uuid || lower_case(devices[i].name).find(part) != std::string::npos)
            found.push_back(i);
    }
    return found;
}

/// Devices that were given up, with their instances: drivers must stay loaded.
struct GivenUp {
    std::mutex mutex;
    std::map<VkDevice, std::shared_ptr<Instance>> devices;
};

/// Never destroyed, since handles of other static objects may end later.
GivenUp& given_up() {
    static GivenUp& all = *new GivenUp;
    return all;
}

}  // namespace

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
    const VkApplicationInfo application = {.sType = VK_STRUCTURE_TYPE_APPLICATION_INFO,
                                           .pApplicationName = "morphray",
                                           .apiVersion = VK_API_VERSION_1_2};
    const VkDebugUtilsMessengerCreateInfoEXT messenger = log_.messenger_info();
    // The messenger in the chain receives messages from creation and destruction of the instance.
    const VkValidationFeatureEnableEXT enabled =
        VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT;
    const VkValidationFeaturesEXT features = {.sType = VK_STRUCTURE_TYPE_VALIDATION_FEATURES_EXT,
                                              .pNext = &messenger,
                                              .enabledValidationFeatureCount = 1,
                                              .pEnabledValidationFeatures = &enabled};
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
    // From this instance: volk's pointers may later be from an instance without debug utils.
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

std::vector<PhysicalDevice> physical_devices(const Instance& instance) {
    std::uint32_t count = 0;
    check(vkEnumeratePhysicalDevices(instance.get(), &count, nullptr), "list devices");
    std::vector<VkPhysicalDevice> handles(count);
    check(vkEnumeratePhysicalDevices(instance.get(), &count, handles.data()), "list devices");
    if (handles.empty()) {
        throw_unavailable(
            "the drivers on this machine have no device; install one, for example "
            "mesa-vulkan-drivers");
    }
    std::vector<PhysicalDevice> devices;
    for (std::uint32_t i = 0; i < handles.size(); ++i) devices.push_back(describe(handles[i], i));
    return devices;
}

std::size_t choose_device(std::span<const DeviceInfo> devices, const std::string& wanted) {
    if (wanted.empty()) return preferred_device(devices);
    const auto refuse = [](const std::string& text) {
        throw Error(ErrorKind::kUnavailable, "Vulkan: " + text);
    };
    const std::string all = "; the devices are " + listing(devices);
    std::vector<std::size_t> found = matches(devices, wanted);
    constexpr std::size_t kUuidDigits = 32;
    if (const auto index = parse_unsigned(wanted); index && wanted.size() != kUuidDigits) {
        if (*index >= devices.size()) refuse("there is no device " + wanted + all);
        found = {*index};
    }
    if (found.empty()) refuse("no device fits '" + wanted + "'" + all);
    if (found.size() > 1) refuse("more than one device fits '" + wanted + "'" + all);
    const DeviceInfo& device = devices[found.front()];
    if (!device.unusable.empty()) {
        refuse(fmt::format("device {} ({}) cannot be used: {}", device.index, device.name,
                           device.unusable));
    }
    return found.front();
}

bool is_given_up(VkDevice device) {
    if (is_forked()) return true;
    GivenUp& all = given_up();
    const std::scoped_lock lock(all.mutex);
    return all.devices.contains(device);
}

Device::Device(std::shared_ptr<Instance> instance, PhysicalDevice physical, bool force_staging)
    : instance_(std::move(instance)),
      physical_(std::move(physical)),
      force_staging_(force_staging) {
    const float priority = 1.0f;
    const VkDeviceQueueCreateInfo queue = {.sType = VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO,
                                           .queueFamilyIndex = physical_.queue_family,
                                           .queueCount = 1,
                                           .pQueuePriorities = &priority};
    const VkDeviceCreateInfo info = {.sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO,
                                     .queueCreateInfoCount = 1,
                                     .pQueueCreateInfos = &queue};
    check(vkCreateDevice(physical_.handle, &info, nullptr, &handle_), "create the device");
    vkGetDeviceQueue(handle_, physical_.queue_family, 0, &queue_);
}

Device::~Device() {
    if (!is_given_up(handle_)) vkDestroyDevice(handle_, nullptr);
}

void Device::submit(const VkSubmitInfo& submission, VkFence fence) {
    const VkResult result = [&] {
        const std::scoped_lock lock(queue_mutex_);
        return vkQueueSubmit(queue_, 1, &submission, fence);
    }();
    if (result == VK_ERROR_DEVICE_LOST) set_lost();
    check(result, "submit work");
}

void Device::finish() noexcept {
    const std::scoped_lock lock(queue_mutex_);
    vkQueueWaitIdle(queue_);
}

void Device::give_up() {
    set_lost();
    GivenUp& all = given_up();
    const std::scoped_lock lock(all.mutex);
    all.devices.emplace(handle_, instance_);
}

}  // namespace mray::gpu
