// Scenes on a Vulkan device that the caller has made, while the caller uses its queue.
#include <gtest/gtest.h>

#include <atomic>
#include <mutex>
#include <thread>
#include <vector>

#include "gpu/vulkan/vulkan_api.h"
#include "tests/gpu/faulty_loader.h"
#include "tests/library/scenes.h"

namespace mray::test {
namespace {

/// An instance, device and queue, as an application makes them.
class Host {
public:
    /// `loader` replaces libvulkan's.
    explicit Host(PFN_vkGetInstanceProcAddr loader = nullptr) : loader_(loader) {
        if (loader != nullptr) {
            volkInitializeCustom(loader);
        } else {
            EXPECT_EQ(volkInitialize(), VK_SUCCESS);
        }
        const VkApplicationInfo application = {.sType = VK_STRUCTURE_TYPE_APPLICATION_INFO,
                                               .apiVersion = VK_API_VERSION_1_2};
        const VkInstanceCreateInfo instance_info = {.sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO,
                                                    .pApplicationInfo = &application};
        EXPECT_EQ(vkCreateInstance(&instance_info, nullptr, &instance_), VK_SUCCESS);
        volkLoadInstance(instance_);
        std::uint32_t count = 1;
        vkEnumeratePhysicalDevices(instance_, &count, &physical_);
        const float priority = 1;
        const VkDeviceQueueCreateInfo queue = {.sType = VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO,
                                               .queueFamilyIndex = 0,
                                               .queueCount = 1,
                                               .pQueuePriorities = &priority};
        const VkDeviceCreateInfo device_info = {.sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO,
                                                .queueCreateInfoCount = 1,
                                                .pQueueCreateInfos = &queue};
        EXPECT_EQ(vkCreateDevice(physical_, &device_info, nullptr, &device_), VK_SUCCESS);
        vkGetDeviceQueue(device_, 0, 0, &queue_);
    }
    ~Host() {
        // Fails under validation if the library has left objects on the device.
        vkDestroyDevice(device_, nullptr);
        vkDestroyInstance(instance_, nullptr);
    }
    Host(const Host&) = delete;

    morphray::VulkanHost handles() {
        return {.instance = instance_,
                .physical_device = physical_,
                .device = device_,
                .queue = queue_,
                .get_instance_proc_addr = reinterpret_cast<void*>(loader_),
                .lock_queue =
                    [this] {
                        mutex_.lock();
                        ++locks_;
                    },
                .unlock_queue = [this] { mutex_.unlock(); }};
    }
    /// The application's own work.
    void submit_nothing() {
        const std::scoped_lock lock(mutex_);
        vkQueueSubmit(queue_, 0, nullptr, VK_NULL_HANDLE);
    }
    int locks() const { return locks_; }

private:
    PFN_vkGetInstanceProcAddr loader_;
    VkInstance instance_ = VK_NULL_HANDLE;
    VkPhysicalDevice physical_ = VK_NULL_HANDLE;
    VkDevice device_ = VK_NULL_HANDLE;
    VkQueue queue_ = VK_NULL_HANDLE;
    std::mutex mutex_;
    std::atomic<int> locks_ = 0;
};

TEST(HostDevice, IsSharedWithTheApplication) {
    Host host;
    UserMesh mesh(torus(40, 24));
    const std::vector<morphray::Ray> rays = world_rays(mesh, 2000, 40);
    {
        const morphray::Device device = morphray::Device::adopt(host.handles());
        EXPECT_EQ(device.name(), "vulkan");
        morphray::Scene scene = morphray::Scene::build(mesh.view(), device);
        morphray::Scene other = morphray::Scene::build(mesh.view(), device);
        const morphray::Scene cpu = scene.on(morphray::Device::cpu());
        std::atomic<bool> done = false;
        std::thread application([&] {
            while (!done) host.submit_nothing();
        });
        std::thread second([&] { hits_of(other, rays); });
        for (int round = 0; round < 3; ++round) {
            scene.update();
            EXPECT_TRUE(morphray::compare(scene, cpu, rays).equal());
        }
        second.join();
        done = true;
        application.join();
        EXPECT_GT(host.locks(), 0);
    }
    // The device is the host's and still works.
    host.submit_nothing();
}

TEST(HostDevice, LeavesADeviceOfTheLibraryAsItIs) {
    Host host;
    const UserMesh small(icosphere(1));
    const UserMesh large(torus(40, 24));
    const std::vector<morphray::Ray> rays = world_rays(large, 500, 44);
    const morphray::Device own = morphray::Device::vulkan();
    const morphray::Scene first = morphray::Scene::build(small.view(), own);
    const morphray::Scene adopted =
        morphray::Scene::build(large.view(), morphray::Device::adopt(host.handles()));
    const morphray::Scene second = morphray::Scene::build(large.view(), own);
    EXPECT_TRUE(morphray::compare(adopted, second, rays).equal());
}

TEST(HostDevice, IsRefusedIfItDoesNotFit) {
    Host host;
    morphray::VulkanHost handles = host.handles();
    handles.queue_family = 77;
    EXPECT_EQ(error_of([&] { morphray::Device::adopt(handles); }), "unavailable");
    handles = host.handles();
    handles.physical_device = handles.device;
    EXPECT_EQ(error_of([&] { morphray::Device::adopt(handles); }), "unavailable");
    handles = host.handles();
    handles.queue = nullptr;
    EXPECT_EQ(error_of([&] { morphray::Device::adopt(handles); }), "bad_argument");
    EXPECT_EQ(error_of([&] { morphray::Device::adopt({}); }), "bad_argument");
}

/// A scene whose device fails.
struct FailingHost {
    Faults faults;
    FaultyLoader loader{faults};
    Host host{loader.get()};
    morphray::Device device = morphray::Device::adopt(host.handles());
    UserMesh mesh{icosphere(3)};
    std::vector<morphray::Ray> rays = world_rays(mesh, 500, 41);

    morphray::Scene scene() const {
        return morphray::Scene::build(mesh.view(), device, {.update = morphray::Refit{}});
    }
};

TEST(HostDevice, ALostDeviceIsReportedByEachCall) {
    FailingHost rig;
    morphray::Scene scene = rig.scene();
    const std::vector<morphray::Hit> hits = hits_of(scene, rig.rays);
    rig.faults.fail_name = "vkQueueSubmit";
    rig.faults.result = VK_ERROR_DEVICE_LOST;
    EXPECT_EQ(error_of([&] { hits_of(scene, rig.rays); }), "device_lost");
    EXPECT_EQ(error_of([&] { scene.occluded(rig.rays[0]); }), "device_lost");
    EXPECT_EQ(error_of([&] { scene.render({.width = 8, .height = 8}); }), "device_lost");
    EXPECT_EQ(error_of([&] { rig.scene(); }), "device_lost");
    for (morphray::Vec3& p : rig.mesh.points) p.x *= 0.5f;
    EXPECT_EQ(error_of([&] {
                  scene.update();
                  scene.last_update();
              }),
              "device_lost");
    rig.faults.fail_name.clear();
    for (morphray::Vec3& p : rig.mesh.points) p.x *= 2;
    const morphray::Scene other = rig.scene();
    expect_same_hits(hits_of(other, rig.rays), hits);
}

TEST(HostDevice, AChangeWithoutMemoryLeavesOtherScenesAlone) {
    FailingHost rig;
    morphray::Scene scene = rig.scene();
    const morphray::Scene other = rig.scene();
    const std::vector<morphray::Hit> hits = hits_of(other, rig.rays);
    scene.attach(rig.mesh.view());
    rig.faults.fail_name = "vkCreateBuffer";
    EXPECT_EQ(error_of([&] { scene.update(); }), "limit");
    rig.faults.fail_name.clear();
    EXPECT_EQ(error_of([&] { scene.update(); }), "limit");
    EXPECT_EQ(error_of([&] { hits_of(scene, rig.rays); }), "limit");
    expect_same_hits(hits_of(other, rig.rays), hits);
}

}  // namespace
}  // namespace mray::test
