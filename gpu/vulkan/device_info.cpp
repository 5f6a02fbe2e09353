#include "gpu/vulkan/device_info.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <string_view>
#include <utility>

#include "common/text/number_text.h"
#include "common/text/text_parts.h"
#include "gpu/vulkan/result.h"
#include "shaders/kernel_interface.h"

namespace mray::gpu {
namespace {

const char* type_name(VkPhysicalDeviceType type) {
    switch (type) {
        case VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU:
            return "discrete";
        case VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU:
            return "integrated";
        case VK_PHYSICAL_DEVICE_TYPE_VIRTUAL_GPU:
            return "virtual";
        case VK_PHYSICAL_DEVICE_TYPE_CPU:
            return "cpu";
        default:
            return "other";
    }
}

/// The compute queue family with the fewest other capabilities: a dedicated one runs undisturbed.
std::optional<std::uint32_t> compute_family(std::span<const VkQueueFamilyProperties> families) {
    std::optional<std::uint32_t> best;
    for (std::uint32_t i = 0; i < families.size(); ++i) {
        const VkQueueFlags flags = families[i].queueFlags;
        if ((flags & VK_QUEUE_COMPUTE_BIT) == 0 || families[i].queueCount == 0) continue;
        const bool is_dedicated = (flags & VK_QUEUE_GRAPHICS_BIT) == 0;
        if (!best || is_dedicated) best = i;
        if (is_dedicated) break;
    }
    return best;
}

std::vector<VkQueueFamilyProperties> queue_families(VkPhysicalDevice device) {
    std::uint32_t count = 0;
    vkGetPhysicalDeviceQueueFamilyProperties(device, &count, nullptr);
    std::vector<VkQueueFamilyProperties> families(count);
    vkGetPhysicalDeviceQueueFamilyProperties(device, &count, families.data());
    return families;
}

/// Whether lavapipe was told to use vectors of another width than most machines have. Mesa 25.0.7,
/// unlike 22.3.6, then crashes (4 lanes: it stores vectors of 8 to places that are aligned for 4)
/// or gives wrong results (16 lanes: right ones without LLVM's optimisations, GALLIVM_PERF=nopt).
bool has_unsound_width(const VkPhysicalDeviceDriverProperties& driver,
                       std::uint32_t subgroup_size) {
    // Lavapipe's number of a version is always 1.
    unsigned mesa = 0;
    return driver.driverID == VK_DRIVER_ID_MESA_LLVMPIPE && subgroup_size != 8 &&
           std::getenv("LP_NATIVE_VECTOR_WIDTH") != nullptr &&
           std::sscanf(driver.driverInfo, "Mesa %u", &mesa) == 1 && mesa > 22;
}

/// Reads the properties of Vulkan 1.1. Returns the reason why the device is unusable, or nothing.
std::string describe_1_1(PhysicalDevice& device) {
    std::vector<VkExtensionProperties> extensions;
    const VkResult listed =
        read_list(extensions, [&](std::uint32_t* count, VkExtensionProperties* items) {
            return vkEnumerateDeviceExtensionProperties(device.handle, nullptr, count, items);
        });
    check(listed, "list device extensions");
    const auto has = [&](std::string_view name) {
        return std::ranges::any_of(
            extensions, [&](const auto& extension) { return name == extension.extensionName; });
    };
    const bool is_1_2 = device.info.api_major > 1 || device.info.api_minor >= 2;
    const bool has_driver = is_1_2 || has(VK_KHR_DRIVER_PROPERTIES_EXTENSION_NAME);
    const bool has_float_controls = is_1_2 || has(VK_KHR_SHADER_FLOAT_CONTROLS_EXTENSION_NAME);
    device.float_controls_is_extension = !is_1_2;

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
    if (has_driver) driver.pNext = std::exchange(id.pNext, &driver);
    if (has_float_controls) floats.pNext = std::exchange(id.pNext, &floats);
    VkPhysicalDeviceProperties2 properties = {
        .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2, .pNext = &id};
    vkGetPhysicalDeviceProperties2(device.handle, &properties);

    device.limits = properties.properties.limits;
    device.max_allocation = maintenance.maxMemoryAllocationSize;
    device.info.uuid = fmt::format("{:02x}", fmt::join(id.deviceUUID, ""));
    device.info.subgroup_size = subgroup.subgroupSize;
    if (has_driver) {
        device.info.driver = fmt::format("{} {}", driver.driverName, driver.driverInfo);
    }
    if (has_unsound_width(driver, subgroup.subgroupSize)) {
        return "it crashes or gives wrong results with such a width of vectors; unset "
               "LP_NATIVE_VECTOR_WIDTH";
    }
    if (!has_float_controls) return "it lacks VK_KHR_shader_float_controls";
    if (floats.shaderRoundingModeRTEFloat32 == VK_FALSE) {
        return "it does not promise to round 32-bit floats to nearest";
    }
    if (floats.shaderSignedZeroInfNanPreserveFloat32 == VK_FALSE) {
        return "it does not promise to keep signed zeros, infinities and NaNs of 32-bit floats";
    }
    return "";
}

std::string find_queue(PhysicalDevice& device) {
    const std::vector<VkQueueFamilyProperties> families = queue_families(device.handle);
    const std::optional<std::uint32_t> family = compute_family(families);
    if (!family) return "it has no compute queue";
    device.queue_family = *family;
    device.timestamp_bits = families[*family].timestampValidBits;
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

/// 32 hex digits without their dashes, or nothing.
std::string as_uuid(const std::string& wanted) {
    std::string digits = lower_case(wanted);
    digits.erase(std::remove(digits.begin(), digits.end(), '-'), digits.end());
    const bool is_hex = digits.find_first_not_of("0123456789abcdef") == std::string::npos;
    return digits.size() == 32 && is_hex ? digits : "";
}

int rank(const DeviceInfo& device) {
    const char* const order[] = {"discrete", "integrated", "virtual", "cpu"};
    return static_cast<int>(std::find(std::begin(order), std::end(order), device.type) - order);
}

std::size_t preferred_device(std::span<const DeviceInfo> devices) {
    std::optional<std::size_t> best;
    for (std::size_t i = 0; i < devices.size(); ++i) {
        if (!devices[i].unusable.empty()) continue;
        if (!best || rank(devices[i]) < rank(devices[*best])) best = i;
    }
    if (best) return *best;
    std::string text = "Vulkan: no usable device: ";
    for (const DeviceInfo& d : devices) text += fmt::format("{}: {}; ", d.name, d.unusable);
    throw Error(ErrorKind::kUnavailable, text + "use the CPU backend");
}

std::vector<std::size_t> matches(std::span<const DeviceInfo> devices, const std::string& wanted) {
    std::vector<std::size_t> found;
    const std::string uuid = as_uuid(wanted);
    for (std::size_t i = 0; i < devices.size(); ++i) {
        const bool fits =
            uuid.empty() ? lower_case(devices[i].name).find(lower_case(wanted)) != std::string::npos
                         : devices[i].uuid == uuid;
        if (fits) found.push_back(i);
    }
    return found;
}

}  // namespace

std::vector<PhysicalDevice> physical_devices(const Instance& instance) {
    std::vector<VkPhysicalDevice> handles;
    const VkResult listed = read_list(handles, [&](std::uint32_t* count, VkPhysicalDevice* items) {
        return vkEnumeratePhysicalDevices(instance.get(), count, items);
    });
    check(listed, "list devices");
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
    std::vector<std::size_t> found;
    if (const auto index = parse_unsigned(wanted); index && as_uuid(wanted).empty()) {
        if (*index >= devices.size()) {
            throw Error(ErrorKind::kUnavailable,
                        fmt::format("Vulkan: there is no device {}; the devices are {}", wanted,
                                    listing(devices)));
        }
        found.push_back(*index);
    } else {
        found = matches(devices, wanted);
    }
    if (found.size() != 1) {
        throw Error(ErrorKind::kUnavailable,
                    fmt::format("Vulkan: {} device fits '{}'; the devices are {}",
                                found.empty() ? "no" : "more than one", wanted, listing(devices)));
    }
    const DeviceInfo& device = devices[found.front()];
    if (!device.unusable.empty()) {
        throw Error(ErrorKind::kUnavailable,
                    fmt::format("Vulkan: device {} ({}) cannot be used: {}", device.index,
                                device.name, device.unusable));
    }
    return found.front();
}

}  // namespace mray::gpu
