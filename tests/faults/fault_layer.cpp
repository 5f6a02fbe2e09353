// A Vulkan layer that counts the calls that return a VkResult, and lets one of them fail (fault.h,
// kind `vulkan`; the error is the VkResult). For one instance and one device at a time.
#include <vulkan/vk_layer.h>
#include <vulkan/vulkan.h>

#include <algorithm>
#include <cstring>
#include <string_view>

#include "tests/faults/fault.h"

namespace mray::test {
namespace {

PFN_vkGetInstanceProcAddr next_instance_proc = nullptr;
PFN_vkGetDeviceProcAddr next_device_proc = nullptr;

/// A call of Vulkan by its type of function pointer; Call tells calls of equal types apart.
template <int Call, class Function>
struct Faulty;

template <int Call, class... Arguments>
struct Faulty<Call, VkResult(VKAPI_PTR*)(Arguments...)> {
    static inline VkResult(VKAPI_PTR* next)(Arguments...) = nullptr;

    static VKAPI_ATTR VkResult VKAPI_CALL call(Arguments... arguments) {
        if (fails(FaultKind::kVulkan)) return static_cast<VkResult>(faults.error);
        return next(arguments...);
    }
};

struct Replacement {
    std::string_view name;
    PFN_vkVoidFunction call;
    void (*set_next)(PFN_vkVoidFunction);
};

template <int Call, class Function>
Replacement replacement(std::string_view name) {
    using F = Faulty<Call, Function>;
    return {name, reinterpret_cast<PFN_vkVoidFunction>(&F::call),
            [](PFN_vkVoidFunction next) { F::next = reinterpret_cast<Function>(next); }};
}

#define MORPHRAY_FAULTY(name) replacement<__COUNTER__, PFN_vk##name>("vk" #name)

const Replacement* find(std::string_view name) {
    static const Replacement replacements[] = {
        MORPHRAY_FAULTY(EnumeratePhysicalDevices),
        MORPHRAY_FAULTY(EnumerateDeviceExtensionProperties),
        MORPHRAY_FAULTY(CreateDebugUtilsMessengerEXT),
        MORPHRAY_FAULTY(AllocateMemory),
        MORPHRAY_FAULTY(MapMemory),
        MORPHRAY_FAULTY(BindBufferMemory),
        MORPHRAY_FAULTY(CreateBuffer),
        MORPHRAY_FAULTY(CreateBufferView),
        MORPHRAY_FAULTY(CreateDescriptorSetLayout),
        MORPHRAY_FAULTY(CreatePipelineLayout),
        MORPHRAY_FAULTY(CreateShaderModule),
        MORPHRAY_FAULTY(CreateComputePipelines),
        MORPHRAY_FAULTY(CreateDescriptorPool),
        MORPHRAY_FAULTY(AllocateDescriptorSets),
        MORPHRAY_FAULTY(CreateCommandPool),
        MORPHRAY_FAULTY(ResetCommandPool),
        MORPHRAY_FAULTY(AllocateCommandBuffers),
        MORPHRAY_FAULTY(BeginCommandBuffer),
        MORPHRAY_FAULTY(EndCommandBuffer),
        MORPHRAY_FAULTY(CreateFence),
        MORPHRAY_FAULTY(ResetFences),
        MORPHRAY_FAULTY(WaitForFences),
        MORPHRAY_FAULTY(CreateQueryPool),
        MORPHRAY_FAULTY(GetQueryPoolResults),
        MORPHRAY_FAULTY(QueueSubmit),
        MORPHRAY_FAULTY(QueueWaitIdle),
        MORPHRAY_FAULTY(DeviceWaitIdle),
    };
    const auto* const found = std::find_if(std::begin(replacements), std::end(replacements),
                                           [&](const Replacement& r) { return r.name == name; });
    return found == std::end(replacements) ? nullptr : found;
}

/// The layer's entry of a kind in the chain that the loader hands over.
template <class Link>
Link* link_of(const void* chain, VkStructureType type) {
    for (auto* link = static_cast<Link*>(const_cast<void*>(chain)); link != nullptr;
         link = static_cast<Link*>(const_cast<void*>(link->pNext))) {
        if (link->sType == type && link->function == VK_LAYER_LINK_INFO) return link;
    }
    return nullptr;
}

VKAPI_ATTR VkResult VKAPI_CALL create_instance(const VkInstanceCreateInfo* info,
                                               const VkAllocationCallbacks* allocator,
                                               VkInstance* instance) {
    auto* const link = link_of<VkLayerInstanceCreateInfo>(
        info->pNext, VK_STRUCTURE_TYPE_LOADER_INSTANCE_CREATE_INFO);
    if (link == nullptr) return VK_ERROR_INITIALIZATION_FAILED;
    if (fails(FaultKind::kVulkan)) return static_cast<VkResult>(faults.error);
    next_instance_proc = link->u.pLayerInfo->pfnNextGetInstanceProcAddr;
    link->u.pLayerInfo = link->u.pLayerInfo->pNext;
    const auto next = reinterpret_cast<PFN_vkCreateInstance>(
        next_instance_proc(VK_NULL_HANDLE, "vkCreateInstance"));
    return next(info, allocator, instance);
}

VKAPI_ATTR VkResult VKAPI_CALL create_device(VkPhysicalDevice physical,
                                             const VkDeviceCreateInfo* info,
                                             const VkAllocationCallbacks* allocator,
                                             VkDevice* device) {
    auto* const link =
        link_of<VkLayerDeviceCreateInfo>(info->pNext, VK_STRUCTURE_TYPE_LOADER_DEVICE_CREATE_INFO);
    if (link == nullptr) return VK_ERROR_INITIALIZATION_FAILED;
    if (fails(FaultKind::kVulkan)) return static_cast<VkResult>(faults.error);
    next_device_proc = link->u.pLayerInfo->pfnNextGetDeviceProcAddr;
    const PFN_vkGetInstanceProcAddr instance_proc = link->u.pLayerInfo->pfnNextGetInstanceProcAddr;
    link->u.pLayerInfo = link->u.pLayerInfo->pNext;
    const auto next =
        reinterpret_cast<PFN_vkCreateDevice>(instance_proc(VK_NULL_HANDLE, "vkCreateDevice"));
    return next(physical, info, allocator, device);
}

template <class Next>
PFN_vkVoidFunction replace(const char* name, Next next_proc) {
    const PFN_vkVoidFunction next = next_proc(name);
    const Replacement* const found = next == nullptr ? nullptr : find(name);
    if (found == nullptr) return next;
    found->set_next(next);
    return found->call;
}

VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL get_device_proc(VkDevice device, const char* name) {
    if (std::strcmp(name, "vkGetDeviceProcAddr") == 0)
        return reinterpret_cast<PFN_vkVoidFunction>(&get_device_proc);
    return replace(name, [&](const char* n) { return next_device_proc(device, n); });
}

VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL get_instance_proc(VkInstance instance, const char* name) {
    if (std::strcmp(name, "vkGetInstanceProcAddr") == 0)
        return reinterpret_cast<PFN_vkVoidFunction>(&get_instance_proc);
    if (std::strcmp(name, "vkGetDeviceProcAddr") == 0)
        return reinterpret_cast<PFN_vkVoidFunction>(&get_device_proc);
    if (std::strcmp(name, "vkCreateInstance") == 0)
        return reinterpret_cast<PFN_vkVoidFunction>(&create_instance);
    if (std::strcmp(name, "vkCreateDevice") == 0)
        return reinterpret_cast<PFN_vkVoidFunction>(&create_device);
    if (next_instance_proc == nullptr) return nullptr;
    return replace(name, [&](const char* n) { return next_instance_proc(instance, n); });
}

}  // namespace
}  // namespace mray::test

extern "C" __attribute__((visibility("default"))) VKAPI_ATTR VkResult VKAPI_CALL
vkNegotiateLoaderLayerInterfaceVersion(VkNegotiateLayerInterface* interface) {
    interface->loaderLayerInterfaceVersion = std::min(interface->loaderLayerInterfaceVersion, 2u);
    interface->pfnGetInstanceProcAddr = mray::test::get_instance_proc;
    interface->pfnGetDeviceProcAddr = mray::test::get_device_proc;
    interface->pfnGetPhysicalDeviceProcAddr = nullptr;
    return VK_SUCCESS;
}
