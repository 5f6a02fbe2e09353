// Ownership of one Vulkan object.
#pragma once

#include <utility>

#include "gpu/vulkan/result.h"
#include "gpu/vulkan/vulkan_api.h"

namespace mray::gpu {

/// From now on nothing of this device is destroyed: it hangs, and may still use its objects.
void give_up(VkDevice device);
bool is_given_up(VkDevice device);
inline bool is_given_up(VkInstance) { return false; }

/// Owns a child of a device (or, with Parent = VkInstance, of an instance), and destroys it by
/// `destroy(parent, handle, nullptr)`. `destroy` points at volk's function pointer, so the call
/// uses the function that the pointer holds at that time. Objects of a device that was given up
/// stay.
template <class Handle, class Parent, auto* destroy>
class UniqueHandle {
public:
    UniqueHandle() = default;
    UniqueHandle(Parent parent, Handle handle) : parent_(parent), handle_(handle) {}
    /// Makes an object by `create(parent, &info, nullptr, &handle)`. Throws
    /// Error("cannot <action>: ...").
    template <class Create, class Info>
    UniqueHandle(Parent parent, Create create, const Info& info, const char* action)
        : parent_(parent) {
        check(create(parent, &info, nullptr, &handle_), action);
    }
    UniqueHandle(UniqueHandle&& other) noexcept
        : parent_(other.parent_), handle_(std::exchange(other.handle_, VK_NULL_HANDLE)) {}
    UniqueHandle& operator=(UniqueHandle&& other) noexcept {
        std::swap(parent_, other.parent_);
        std::swap(handle_, other.handle_);
        return *this;
    }
    ~UniqueHandle() {
        if (handle_ != VK_NULL_HANDLE && !is_given_up(parent_))
            (*destroy)(parent_, handle_, nullptr);
    }

    Handle get() const { return handle_; }

private:
    Parent parent_ = VK_NULL_HANDLE;
    Handle handle_ = VK_NULL_HANDLE;
};

template <class Handle, auto* destroy>
using DeviceHandle = UniqueHandle<Handle, VkDevice, destroy>;

using UniqueBuffer = DeviceHandle<VkBuffer, &vkDestroyBuffer>;
using UniqueBufferView = DeviceHandle<VkBufferView, &vkDestroyBufferView>;
using UniqueCommandPool = DeviceHandle<VkCommandPool, &vkDestroyCommandPool>;
using UniqueDescriptorPool = DeviceHandle<VkDescriptorPool, &vkDestroyDescriptorPool>;
using UniqueDescriptorSetLayout =
    DeviceHandle<VkDescriptorSetLayout, &vkDestroyDescriptorSetLayout>;
using UniqueFence = DeviceHandle<VkFence, &vkDestroyFence>;
using UniqueMemory = DeviceHandle<VkDeviceMemory, &vkFreeMemory>;
using UniquePipeline = DeviceHandle<VkPipeline, &vkDestroyPipeline>;
using UniquePipelineLayout = DeviceHandle<VkPipelineLayout, &vkDestroyPipelineLayout>;
using UniqueQueryPool = DeviceHandle<VkQueryPool, &vkDestroyQueryPool>;
using UniqueShaderModule = DeviceHandle<VkShaderModule, &vkDestroyShaderModule>;
using UniqueMessenger =
    UniqueHandle<VkDebugUtilsMessengerEXT, VkInstance, &vkDestroyDebugUtilsMessengerEXT>;

}  // namespace mray::gpu
