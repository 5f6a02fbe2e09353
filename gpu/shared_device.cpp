#include "gpu/shared_device.h"

#include <algorithm>
#include <mutex>
#include <utility>
#include <vector>

namespace mray::gpu {
namespace {

struct Registry {
    std::mutex mutex;
    std::shared_ptr<Instance> instance;
    std::vector<PhysicalDevice> physical;
    std::vector<std::shared_ptr<SharedDevice>> devices;

    /// Makes the instance and lists its devices, once. Call it with the mutex locked.
    void start() {
        if (instance != nullptr) return;
        auto made = std::make_shared<Instance>(false, nullptr);
        physical = physical_devices(*made);
        instance = std::move(made);
    }
};

/// Never destroyed: at the end of a process its driver may be gone first.
Registry& registry() {
    static Registry& all = *new Registry;
    return all;
}

std::vector<DeviceInfo> infos_of(const std::vector<PhysicalDevice>& devices) {
    std::vector<DeviceInfo> infos;
    for (const PhysicalDevice& d : devices) infos.push_back(d.info);
    return infos;
}

PhysicalDevice choose(const std::vector<PhysicalDevice>& devices, const std::string& wanted) {
    return devices[choose_device(infos_of(devices), wanted)];
}

std::shared_ptr<SharedDevice> make_alone(const VulkanConfig& config, const Tuning& tuning) {
    auto instance = std::make_shared<Instance>(config.validate, tuning.loader, tuning.log);
    PhysicalDevice physical = choose(physical_devices(*instance), config.device);
    return std::make_shared<SharedDevice>(std::move(instance), std::move(physical),
                                          tuning.force_staging);
}

}  // namespace

std::shared_ptr<SharedDevice> open_device(const VulkanConfig& config, const Tuning& tuning) {
    Registry& all = registry();
    const std::scoped_lock lock(all.mutex);
    if (config.validate || tuning.loader != nullptr || tuning.log != nullptr ||
        tuning.force_staging) {
        return make_alone(config, tuning);
    }
    all.start();
    PhysicalDevice physical = choose(all.physical, config.device);
    const auto place = std::ranges::find_if(all.devices, [&](const auto& device) {
        return device->device.physical().handle == physical.handle;
    });
    if (place != all.devices.end() && !(*place)->device.is_lost()) return *place;
    auto made = std::make_shared<SharedDevice>(all.instance, std::move(physical), false);
    if (place == all.devices.end()) {
        all.devices.push_back(made);
    } else {
        *place = made;
    }
    return made;
}

bool is_lost(const SharedDevice& device) { return device.device.is_lost(); }

std::vector<DeviceInfo> list_devices(LoaderFunction loader) {
    Registry& all = registry();
    const std::scoped_lock lock(all.mutex);
    if (loader != nullptr) return infos_of(physical_devices(Instance(false, loader)));
    all.start();
    return infos_of(all.physical);
}

DeviceInfo find_device(const std::string& device) {
    const std::vector<DeviceInfo> devices = list_devices();
    return devices[choose_device(devices, device)];
}

}  // namespace mray::gpu
