// Ownership of one Vulkan object.
#pragma once

#include <utility>

#include "gpu/vulkan/result.h"
#include "gpu/vulkan/vulkan_api.h"

namespace mray::gpu {

bool is_given_up(VkDevice device);

/// Owns a child of a device, and destroys it by `destroy(device, handle, nullptr)`. `destroy`
/// points at volk's function pointer, so the call uses the function that the pointer holds at that
/// time. Objects of a device that was given up stay.
template <class Handle, auto* destroy>
class UniqueHandle {
public:
    UniqueHandle() = default;
    UniqueHandle(VkDevice device, Handle handle) : device_(device), handle_(handle) {}
    /// Makes an object by `create(device, &info, nullptr, &handle)`. Throws
    /// Error("cannot <action>: ...").
    template <class Create, class Info>
    UniqueHandle(VkDevice device, Create create, const Info& info, const char* action)
        : device_(device) {
        check(create(device, &info, nullptr, &handle_), action);
    }
    UniqueHandle(UniqueHandle&& other) noexcept
        : device_(other.device_), handle_(std::exchange(other.handle_, VK_NULL_HANDLE)) {}
    UniqueHandle& operator=(UniqueHandle&& other) noexcept {
        std::swap(device_, other.device_);
        std::swap(handle_, other.handle_);
        return *this;
    }
    ~UniqueHandle() {
        if (handle_ != VK_NULL_HANDLE && !is_given_up(device_))
            (*destroy)(device_, handle_, nullptr);
    }

    Handle get() const { return handle_; }

private:
    VkDevice device_ = VK_NULL_HANDLE;
    Handle handle_ = VK_NULL_HANDLE;
};

using UniqueBuffer = UniqueHandle<VkBuffer, &vkDestroyBuffer>;
using UniqueBufferView = UniqueHandle<VkBufferView, &vkDestroyBufferView>;
using UniqueCommandPool = UniqueHandle<VkCommandPool, &vkDestroyCommandPool>;
using UniqueDescriptorPool = UniqueHandle<VkDescriptorPool, &vkDestroyDescriptorPool>;
using UniqueDescriptorSetLayout =
    UniqueHandle<VkDescriptorSetLayout, &vkDestroyDescriptorSetLayout>;
using UniqueFence = UniqueHandle<VkFence, &vkDestroyFence>;
using UniqueMemory = UniqueHandle<VkDeviceMemory, &vkFreeMemory>;
using UniquePipeline = UniqueHandle<VkPipeline, &vkDestroyPipeline>;
using UniquePipelineLayout = UniqueHandle<VkPipelineLayout, &vkDestroyPipelineLayout>;
using UniqueQueryPool = UniqueHandle<VkQueryPool, &vkDestroyQueryPool>;
using UniqueShaderModule = UniqueHandle<VkShaderModule, &vkDestroyShaderModule>;

}  // namespace mray::gpu
