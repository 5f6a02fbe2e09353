#include "tests/gpu/faulty_loader.h"

#include <dlfcn.h>

#include <algorithm>
#include <cstring>
#include <mutex>
#include <stdexcept>
#include <string_view>
#include <vector>

namespace mray::test {
namespace {

// A global, since Vulkan's functions carry no user data.
Faults*& active() {
    static Faults* faults = nullptr;
    return faults;
}

PFN_vkGetInstanceProcAddr real_loader() {
    void* const library = dlopen("libvulkan.so.1", RTLD_NOW | RTLD_LOCAL);
    if (library == nullptr) throw std::runtime_error("no Vulkan library");
    return reinterpret_cast<PFN_vkGetInstanceProcAddr>(dlsym(library, "vkGetInstanceProcAddr"));
}

bool fails(const char* name) {
    // A backend compiles kernels in several threads.
    static std::mutex mutex;
    const std::scoped_lock lock(mutex);
    // Volk's pointers stay after the loader has ended.
    if (active() == nullptr) return false;
    Faults& f = *active();
    const bool is_counted = f.counts(name);
    const std::size_t index = f.call_count;
    if (is_counted) ++f.call_count;
    const bool has_turn = is_counted && (f.keep_failing ? index >= f.fail_at : index == f.fail_at);
    if (f.fail_name.empty() ? !has_turn : f.fail_name != name) return false;
    f.failed_name = name;
    return true;
}

/// A function name as template argument.
template <std::size_t size>
struct Name {
    constexpr Name(const char (&text)[size]) { std::copy_n(text, size, chars); }
    char chars[size];
};

template <Name name, class Function>
struct Hook;

template <Name name, class... Args>
struct Hook<name, VkResult(VKAPI_PTR*)(Args...)> {
    static inline VkResult(VKAPI_PTR* real)(Args...) = nullptr;
    static VKAPI_ATTR VkResult VKAPI_CALL call(Args... args) {
        return fails(name.chars) ? active()->result : real(args...);
    }
    static PFN_vkVoidFunction wrap(PFN_vkVoidFunction function) {
        real = reinterpret_cast<VkResult(VKAPI_PTR*)(Args...)>(function);
        return reinterpret_cast<PFN_vkVoidFunction>(&call);
    }
};

struct Entry {
    std::string_view name;
    PFN_vkVoidFunction (*wrap)(PFN_vkVoidFunction);
};

#define HOOK(name) \
    { #name, &Hook < #name, PFN_##name> ::wrap }

const Entry kFailing[] = {
    HOOK(vkAllocateCommandBuffers),
    HOOK(vkAllocateDescriptorSets),
    HOOK(vkAllocateMemory),
    HOOK(vkBeginCommandBuffer),
    HOOK(vkBindBufferMemory),
    HOOK(vkCreateBuffer),
    HOOK(vkCreateBufferView),
    HOOK(vkCreateCommandPool),
    HOOK(vkCreateComputePipelines),
    HOOK(vkCreateDebugUtilsMessengerEXT),
    HOOK(vkCreateDescriptorPool),
    HOOK(vkCreateDescriptorSetLayout),
    HOOK(vkCreateDevice),
    HOOK(vkCreateFence),
    HOOK(vkCreateInstance),
    HOOK(vkCreatePipelineLayout),
    HOOK(vkCreateQueryPool),
    HOOK(vkEndCommandBuffer),
    HOOK(vkEnumerateDeviceExtensionProperties),
    HOOK(vkEnumerateInstanceExtensionProperties),
    HOOK(vkEnumerateInstanceLayerProperties),
    HOOK(vkEnumerateInstanceVersion),
    HOOK(vkGetQueryPoolResults),
    HOOK(vkMapMemory),
    HOOK(vkQueueSubmit),
    HOOK(vkResetCommandPool),
    HOOK(vkResetFences),
    HOOK(vkWaitForFences),
};

#undef HOOK

using ListDevices = Hook<"vkEnumeratePhysicalDevices", PFN_vkEnumeratePhysicalDevices>;

VKAPI_ATTR VkResult VKAPI_CALL list_devices(VkInstance instance, std::uint32_t* count,
                                            VkPhysicalDevice* devices) {
    if (active() != nullptr && active()->hide_devices) {
        *count = 0;
        return VK_SUCCESS;
    }
    return ListDevices::call(instance, count, devices);
}

template <class Function>
struct Real {
    static inline Function call = nullptr;
};

VKAPI_ATTR void VKAPI_CALL properties(VkPhysicalDevice device, VkPhysicalDeviceProperties* out) {
    Real<PFN_vkGetPhysicalDeviceProperties>::call(device, out);
    if (active() != nullptr && active()->edit_properties) active()->edit_properties(*out);
}

VKAPI_ATTR void VKAPI_CALL properties2(VkPhysicalDevice device, VkPhysicalDeviceProperties2* out) {
    Real<PFN_vkGetPhysicalDeviceProperties2>::call(device, out);
    if (active() == nullptr) return;
    if (active()->edit_properties) active()->edit_properties(out->properties);
    for (auto* p = static_cast<VkBaseOutStructure*>(out->pNext); p != nullptr; p = p->pNext) {
        if (p->sType != VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FLOAT_CONTROLS_PROPERTIES) continue;
        if (!active()->edit_float_controls) continue;
        active()->edit_float_controls(
            *reinterpret_cast<VkPhysicalDeviceFloatControlsProperties*>(p));
    }
}

VKAPI_ATTR void VKAPI_CALL queue_families(VkPhysicalDevice device, std::uint32_t* count,
                                          VkQueueFamilyProperties* out) {
    Real<PFN_vkGetPhysicalDeviceQueueFamilyProperties>::call(device, count, out);
    if (out == nullptr || active() == nullptr || !active()->edit_queue_family) return;
    for (std::uint32_t i = 0; i < *count; ++i) active()->edit_queue_family(out[i]);
}

using CreateModule = Hook<"vkCreateShaderModule", PFN_vkCreateShaderModule>;

VKAPI_ATTR VkResult VKAPI_CALL create_module(VkDevice device, const VkShaderModuleCreateInfo* info,
                                             const VkAllocationCallbacks* allocator,
                                             VkShaderModule* module) {
    if (active() == nullptr || !active()->edit_kernel)
        return CreateModule::call(device, info, allocator, module);
    std::vector<std::uint32_t> words(info->pCode, info->pCode + info->codeSize / 4);
    {
        // A backend compiles kernels in several threads.
        static std::mutex mutex;
        const std::scoped_lock lock(mutex);
        active()->edit_kernel(words);
    }
    VkShaderModuleCreateInfo edited = *info;
    edited.codeSize = 4 * words.size();
    edited.pCode = words.data();
    return CreateModule::call(device, &edited, allocator, module);
}

template <class Function>
PFN_vkVoidFunction replace(PFN_vkVoidFunction real, Function by) {
    Real<Function>::call = reinterpret_cast<Function>(real);
    return reinterpret_cast<PFN_vkVoidFunction>(by);
}

VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL get_function(VkInstance instance, const char* name) {
    const PFN_vkVoidFunction real = real_loader()(instance, name);
    if (real == nullptr) return nullptr;
    const std::string_view wanted = name;
    for (const Entry& entry : kFailing)
        if (entry.name == wanted) return entry.wrap(real);
    if (wanted == "vkEnumeratePhysicalDevices") {
        ListDevices::wrap(real);
        return reinterpret_cast<PFN_vkVoidFunction>(&list_devices);
    }
    if (wanted == "vkCreateShaderModule") {
        CreateModule::wrap(real);
        return reinterpret_cast<PFN_vkVoidFunction>(&create_module);
    }
    if (wanted == "vkGetPhysicalDeviceProperties")
        return replace<PFN_vkGetPhysicalDeviceProperties>(real, &properties);
    if (wanted == "vkGetPhysicalDeviceProperties2")
        return replace<PFN_vkGetPhysicalDeviceProperties2>(real, &properties2);
    if (wanted == "vkGetPhysicalDeviceQueueFamilyProperties")
        return replace<PFN_vkGetPhysicalDeviceQueueFamilyProperties>(real, &queue_families);
    return real;
}

}  // namespace

FaultyLoader::FaultyLoader(Faults& faults) {
    if (active() != nullptr) throw std::logic_error("one faulty loader at a time");
    active() = &faults;
}

FaultyLoader::~FaultyLoader() { active() = nullptr; }

PFN_vkGetInstanceProcAddr FaultyLoader::get() const { return &get_function; }

}  // namespace mray::test
