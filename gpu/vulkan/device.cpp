#include "gpu/vulkan/device.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "gpu/vulkan/result.h"

namespace mray::gpu {
namespace {

struct GivenUp {
    std::atomic<bool> is_any = false;
    std::mutex mutex;
    std::vector<VkDevice> devices;
    /// Their instances must stay, and the drivers with them.
    std::vector<std::shared_ptr<Instance>> instances;
};

/// Never destroyed, since handles of other static objects may end later.
GivenUp& given_up() {
    static GivenUp& all = *new GivenUp;
    return all;
}

VkDevice create_device(const PhysicalDevice& physical) {
    const float priority = 1.0f;
    const VkDeviceQueueCreateInfo queue = {
        .sType = VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO,
        .queueFamilyIndex = physical.queue_family,
        .queueCount = 1,
        .pQueuePriorities = &priority,
    };
    std::vector<const char*> extensions;
    if (physical.float_controls_is_extension)
        extensions.push_back(VK_KHR_SHADER_FLOAT_CONTROLS_EXTENSION_NAME);
    const VkDeviceCreateInfo info = {
        .sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO,
        .queueCreateInfoCount = 1,
        .pQueueCreateInfos = &queue,
        .enabledExtensionCount = static_cast<std::uint32_t>(extensions.size()),
        .ppEnabledExtensionNames = extensions.data(),
    };
    VkDevice device = VK_NULL_HANDLE;
    check(vkCreateDevice(physical.handle, &info, nullptr, &device), "create the device");
    return device;
}

}  // namespace

bool is_given_up(VkDevice device) {
    if (is_forked()) return true;
    GivenUp& all = given_up();
    if (!all.is_any) return false;
    const std::scoped_lock lock(all.mutex);
    return std::ranges::find(all.devices, device) != all.devices.end();
}

Device::Device(std::shared_ptr<Instance> instance, PhysicalDevice physical, bool force_staging)
    : instance_(std::move(instance)),
      physical_(std::move(physical)),
      force_staging_(force_staging),
      handle_(create_device(physical_)) {
    vkGetDeviceQueue(handle_, physical_.queue_family, 0, &queue_);
}

Device::~Device() {
    if (!is_given_up(handle_)) vkDestroyDevice(handle_, nullptr);
}

void Device::submit(const VkSubmitInfo& submission, VkFence fence) {
    VkResult result = VK_SUCCESS;
    {
        const std::scoped_lock lock(queue_mutex_);
        result = vkQueueSubmit(queue_, 1, &submission, fence);
    }
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
    all.devices.push_back(handle_);
    all.instances.push_back(instance_);
    all.is_any = true;
}

}  // namespace mray::gpu
