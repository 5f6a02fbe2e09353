#include "gpu/shared_device.h"

#include <algorithm>
#include <utility>

namespace mray::gpu {
namespace {

constexpr VkBufferUsageFlags kWritten = VK_BUFFER_USAGE_STORAGE_BUFFER_BIT;

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

}  // namespace

std::shared_ptr<SharedDevice> open_device(const VulkanConfig& config, const Tuning& tuning) {
    throw_if_forked();
    Registry& all = registry();
    const std::scoped_lock lock(all.mutex);
    if (config.validate || tuning.loader != nullptr || tuning.log != nullptr ||
        tuning.force_staging) {
        auto instance = std::make_shared<Instance>(config.validate, tuning.loader, tuning.log);
        PhysicalDevice physical = choose(physical_devices(*instance), config.device);
        return std::make_shared<SharedDevice>(std::move(instance), std::move(physical),
                                              tuning.force_staging);
    }
    all.start();
    PhysicalDevice physical = choose(all.physical, config.device);
    const auto open = std::ranges::find_if(all.devices, [&](const auto& device) {
        return device->device.physical().handle == physical.handle;
    });
    if (open != all.devices.end() && !(*open)->device.is_lost()) return *open;
    auto made = std::make_shared<SharedDevice>(all.instance, std::move(physical), false);
    if (open == all.devices.end()) {
        all.devices.push_back(made);
    } else {
        *open = made;
    }
    return made;
}

bool is_lost(const SharedDevice& device) { return device.device.is_lost(); }

std::vector<DeviceInfo> list_devices(LoaderFunction loader) {
    throw_if_forked();
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

RayBuffers::RayBuffers(Device& device, const PassSize& pass_size, BufferKind buffer_kind)
    : size(pass_size),
      kind(buffer_kind),
      rays(device, kind, "rays", sizeof(Ray) * size.rays(), VK_FORMAT_R32G32B32A32_UINT, kWritten),
      hits(device, kind, "hits", sizeof(Hit) * size.rays(), VK_FORMAT_R32G32B32A32_UINT, kWritten),
      visible_pixels(device, kind, "visible pixels", 4 * size.rays(), VK_FORMAT_R32_UINT, kWritten),
      occlusion(device, kind, "occlusion", 4 * size.rays(), VK_FORMAT_R32_UINT, kWritten),
      pixels(device, "pixels", 4 * size.rays(), kWritten, Memory::kDevice),
      linear(device, "linear colours", 12 * size.rays(), kWritten, Memory::kDevice),
      work(device, "work", sizeof(WorkHeader) + sizeof(Suspended) * size.rays(), kWritten,
           Memory::kDevice),
      states(device, "states", 4 * kStateUints * size.resume_slots, kWritten, Memory::kDevice),
      header(device, "work header", sizeof(WorkHeader), 0, Memory::kHost) {
    const auto add_copy = [&](Buffer& copy, const char* name, const Buffer& buffer) {
        if (buffer.mapped().empty())
            copy = Buffer(device, name, buffer.size(), kWritten, Memory::kHost);
    };
    add_copy(hits_copy, "copy of hits", hits.buffer);
    add_copy(occlusion_copy, "copy of occlusion", occlusion.buffer);
    add_copy(pixels_copy, "copy of pixels", pixels);
    add_copy(linear_copy, "copy of linear colours", linear);
}

void RayBuffers::add_to(Bindings& bindings) const {
    rays.bind(bindings, kBindRays);
    bindings.buffers[kBindSurfaces] = rays.buffer.get();
    visible_pixels.bind(bindings, kBindVisiblePixels);
    bindings.buffers[kBindVisiblePixelsOut] = visible_pixels.buffer.get();
    hits.bind(bindings, kBindFoundHits);
    bindings.buffers[kBindHits] = hits.buffer.get();
    occlusion.bind(bindings, kBindFoundOcclusion);
    bindings.buffers[kBindOcclusion] = occlusion.buffer.get();
    bindings.buffers[kBindPixels] = pixels.get();
    bindings.buffers[kBindLinear] = linear.get();
    bindings.buffers[kBindWork] = work.get();
    bindings.buffers[kBindStates] = states.get();
    bindings.buffers[kBindPackedHits] = hits_copy.get();
}

std::unique_ptr<RayBuffers> RayBufferPool::take(Device& device, const PassSize& size,
                                                BufferKind kind) {
    std::unique_lock lock(mutex_);
    const auto idle = std::ranges::find_if(
        idle_, [&](const auto& buffers) { return buffers->size == size && buffers->kind == kind; });
    if (idle != idle_.end()) {
        std::unique_ptr<RayBuffers> buffers = std::move(*idle);
        idle_.erase(idle);
        return buffers;
    }
    lock.unlock();
    return std::make_unique<RayBuffers>(device, size, kind);
}

void RayBufferPool::give_back(std::unique_ptr<RayBuffers> buffers) noexcept {
    try {
        const std::scoped_lock lock(mutex_);
        idle_.push_back(std::move(buffers));
    } catch (const std::bad_alloc&) {
        // The buffers are freed instead.
    }
}

}  // namespace mray::gpu
