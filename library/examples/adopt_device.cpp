// An application with a Vulkan device of its own lets morphray trace on it.
#include <vulkan/vulkan.h>

#include <cstdio>
#include <morphray/morphray.hpp>
#include <mutex>

namespace mr = morphray;

namespace {

// The Vulkan objects that an application has anyway.
struct Application {
    VkInstance instance = VK_NULL_HANDLE;
    VkPhysicalDevice physical_device = VK_NULL_HANDLE;
    VkDevice device = VK_NULL_HANDLE;
    VkQueue queue = VK_NULL_HANDLE;
    std::uint32_t queue_family = 0;
    std::mutex queue_mutex;

    // Returns whether there is a device with a compute queue and Vulkan 1.2, which has all that
    // morphray needs.
    bool start() {
        VkApplicationInfo application = {};
        application.sType = VK_STRUCTURE_TYPE_APPLICATION_INFO;
        application.apiVersion = VK_API_VERSION_1_2;
        VkInstanceCreateInfo instance_info = {};
        instance_info.sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO;
        instance_info.pApplicationInfo = &application;
        if (vkCreateInstance(&instance_info, nullptr, &instance) != VK_SUCCESS) return false;
        std::uint32_t count = 1;
        vkEnumeratePhysicalDevices(instance, &count, &physical_device);
        if (count == 0 || !find_queue_family()) return false;
        const float priority = 1;
        VkDeviceQueueCreateInfo queue_info = {};
        queue_info.sType = VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO;
        queue_info.queueFamilyIndex = queue_family;
        queue_info.queueCount = 1;
        queue_info.pQueuePriorities = &priority;
        VkDeviceCreateInfo device_info = {};
        device_info.sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO;
        device_info.queueCreateInfoCount = 1;
        device_info.pQueueCreateInfos = &queue_info;
        if (vkCreateDevice(physical_device, &device_info, nullptr, &device) != VK_SUCCESS)
            return false;
        vkGetDeviceQueue(device, queue_family, 0, &queue);
        return true;
    }
    bool find_queue_family() {
        VkPhysicalDeviceProperties properties = {};
        vkGetPhysicalDeviceProperties(physical_device, &properties);
        if (properties.apiVersion < VK_API_VERSION_1_2) return false;
        std::uint32_t count = 0;
        vkGetPhysicalDeviceQueueFamilyProperties(physical_device, &count, nullptr);
        std::vector<VkQueueFamilyProperties> families(count);
        vkGetPhysicalDeviceQueueFamilyProperties(physical_device, &count, families.data());
        for (queue_family = 0; queue_family < count; ++queue_family) {
            if ((families[queue_family].queueFlags & VK_QUEUE_COMPUTE_BIT) != 0) return true;
        }
        return false;
    }
    ~Application() {
        if (device != VK_NULL_HANDLE) vkDestroyDevice(device, nullptr);
        if (instance != VK_NULL_HANDLE) vkDestroyInstance(instance, nullptr);
    }
};

}  // namespace

int main() {
    Application application;
    if (!application.start()) {
        std::printf("no Vulkan device here: nothing to adopt\n");
        return 0;
    }
    const std::vector<mr::Vec3> points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    const std::vector<std::uint32_t> triangles = {0, 1, 2};
    const mr::Ray ray{.org = {0.25f, 0.5f, 2}, .dir = {0, 0, -1}};
    try {
        // The lock is needed only if the application submits while calls of the library run.
        const mr::Device device =
            mr::Device::adopt({.instance = application.instance,
                               .physical_device = application.physical_device,
                               .device = application.device,
                               .queue = application.queue,
                               .queue_family = application.queue_family,
                               .lock_queue = [&] { application.queue_mutex.lock(); },
                               .unlock_queue = [&] { application.queue_mutex.unlock(); }});
        const mr::Scene scene = mr::Scene::build({mr::packed(points), triangles}, device);
        const mr::Hit hit = scene.intersect(ray);
        std::printf("%s: triangle %u at t %g\n", device.description().c_str(), hit.prim_id, hit.t);
        return hit == scene.on(mr::Device::cpu()).intersect(ray) && hit.t == 2 ? 0 : 1;
    } catch (const mr::Error& error) {
        if (error.code() != mr::ErrorCode::unavailable) throw;
        std::printf("%s\n", error.what());
        return 0;
    }
}
