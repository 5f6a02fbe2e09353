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
    const std::scoped_lock lock(loader_mutex());
    check(vkCreateDevice(physical.handle, &info, nullptr, &device), "create the device");
    return device;
}

/// Keeps the queue of an application locked by its own means.
class HostLock {
public:
    explicit HostLock(const HostDevice* host) : host_(host) {
        if (host_ != nullptr && host_->lock_queue) host_->lock_queue();
    }
    ~HostLock() {
        if (host_ != nullptr && host_->unlock_queue) host_->unlock_queue();
    }
    HostLock(const HostLock&) = delete;

private:
    const HostDevice* host_;
};

}  // namespace

void give_up(VkDevice device) {
    GivenUp& all = given_up();
    const std::scoped_lock lock(all.mutex);
    all.devices.push_back(device);
    all.is_any = true;
}

bool is_given_up(VkDevice device) {
    GivenUp& all = given_up();
    if (!all.is_any) return false;
    const std::scoped_lock lock(all.mutex);
    return std::ranges::find(all.devices, device) != all.devices.end();
}

Device::Device(std::shared_ptr<Instance> instance, PhysicalDevice physical,
               std::shared_ptr<const HostDevice> host, bool force_staging)
    : instance_(std::move(instance)),
      physical_(std::move(physical)),
      host_(std::move(host)),
      force_staging_(force_staging) {
    if (host_ != nullptr) {
        handle_ = static_cast<VkDevice>(host_->device);
        queue_ = static_cast<VkQueue>(host_->queue);
        return;
    }
    handle_ = create_device(physical_);
    vkGetDeviceQueue(handle_, physical_.queue_family, 0, &queue_);
}

Device::~Device() {
    if (is_given_up(handle_)) {
        // The instance of a device that may still run must stay, and its driver with it.
        static std::vector<std::shared_ptr<Instance>>& kept =
            *new std::vector<std::shared_ptr<Instance>>;
        static std::mutex& mutex = *new std::mutex;
        const std::scoped_lock lock(mutex);
        kept.push_back(std::move(instance_));
        return;
    }
    if (host_ != nullptr) return;
    const std::scoped_lock lock(loader_mutex());
    vkDestroyDevice(handle_, nullptr);
}

void Device::submit(const VkSubmitInfo& submission, VkFence fence) {
    const std::scoped_lock lock(queue_mutex_);
    const HostLock host_lock(host_.get());
    const VkResult result = vkQueueSubmit(queue_, 1, &submission, fence);
    if (result == VK_ERROR_DEVICE_LOST) set_lost();
    check(result, "submit work");
}

void Device::finish() noexcept {
    const std::scoped_lock lock(queue_mutex_);
    const HostLock host_lock(host_.get());
    vkQueueWaitIdle(queue_);
}

void Device::give_up() {
    set_lost();
    mray::gpu::give_up(handle_);
}

void Device::name_object(VkObjectType type, std::uint64_t handle, const std::string& text) {
    const PFN_vkSetDebugUtilsObjectNameEXT set_name = instance_->set_name();
    if (set_name == nullptr) return;
    const VkDebugUtilsObjectNameInfoEXT info = {
        .sType = VK_STRUCTURE_TYPE_DEBUG_UTILS_OBJECT_NAME_INFO_EXT,
        .objectType = type,
        .objectHandle = handle,
        .pObjectName = text.c_str(),
    };
    const std::scoped_lock lock(loader_mutex());
    check(set_name(handle_, &info), "name an object");
}

}  // namespace mray::gpu
