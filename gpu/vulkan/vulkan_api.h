// Vulkan's functions, its results as errors, and ownership of its objects. volk fills pointers to
// functions at run time: the program starts without a Vulkan library, and tests make any call fail.
#pragma once

#define VK_NO_PROTOTYPES
#include <volk.h>

#include <utility>

#include "common/base/errors.h"

namespace mray::gpu {

/// The name of a result, such as "VK_ERROR_DEVICE_LOST", or its number if it is unknown.
std::string result_name(VkResult result);

/// kLimit for exhausted memory, kDeviceLost for a lost device and a timeout, kUnavailable for
/// missing features, extensions and layers, kInternal for the rest.
ErrorKind error_kind_of(VkResult result);

/// Throws Error(kUnavailable, "Vulkan: <text>"), or kLimit if a driver finds no memory to start.
[[noreturn]] void throw_unavailable(const std::string& text);

[[noreturn]] void throw_result(VkResult result, const char* action);

/// Throws Error("cannot <action>: <result>") if the result is not VK_SUCCESS.
inline void check(VkResult result, const char* action) {
    if (result != VK_SUCCESS) throw_result(result, action);
}

bool is_given_up(VkDevice device);

/// Owns a child of a device, which volk's `*destroy` destroys unless the device was given up.
template <class Handle, auto* destroy>
class UniqueHandle {
public:
    UniqueHandle() = default;
    UniqueHandle(VkDevice device, Handle handle) : device_(device), handle_(handle) {}
    /// Makes an object by `create`. Throws Error("cannot <action>: ...").
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
