#include "morphray/device.hpp"

#include <utility>

#include "common/base/errors.h"
#include "common/bvh/builder/bvh_builder.h"
#include "common/simd/simd_target.h"
#include "library/device_impl.h"
#include "library/scene/errors.h"
#ifdef MORPHRAY_HAS_VULKAN
#include "gpu/vulkan_backend.h"
#endif

namespace morphray {
namespace {

#ifdef MORPHRAY_HAS_VULKAN
/// Making an instance fills function pointers that all instances share, so it happens in one thread
/// at a time.
std::mutex& instance_mutex() {
    static std::mutex mutex;
    return mutex;
}
#endif

}  // namespace

namespace detail {

DeviceImpl::DeviceImpl(Kind kind, const CpuOptions& cpu, const VulkanOptions& vulkan,
                       const VulkanHost& host)
    : kind_(kind),
      cpu_(cpu),
      vulkan_(vulkan),
      host_(host),
      arena_(cpu.threads),
      simd_target_(mray::find_simd_target(cpu.simd == mray::kSimdOff ? "scalar" : cpu.simd)) {
    std::unique_ptr<mray::Backend> backend = make_backend();
    name_ = backend->info().name;
    description_ = backend->info().description;
    if (kind_ == Kind::vulkan) idle_.push_back(std::move(backend));
}

std::unique_ptr<mray::Backend> DeviceImpl::make_vulkan_backend() {
#ifdef MORPHRAY_HAS_VULKAN
    mray::gpu::VulkanConfig config{.device = vulkan_.device, .validate = vulkan_.validate};
    if (host_.device != nullptr) {
        auto host = std::make_shared<mray::gpu::HostDevice>();
        host->instance = host_.instance;
        host->physical_device = host_.physical_device;
        host->device = host_.device;
        host->queue = host_.queue;
        host->queue_family = host_.queue_family;
        host->get_instance_proc_addr = host_.get_instance_proc_addr;
        host->lock_queue = [this] {
            std::unique_lock lock(queue_mutex_);
            if (host_.lock_queue) host_.lock_queue();
            lock.release();
        };
        host->unlock_queue = [this] {
            if (host_.unlock_queue) host_.unlock_queue();
            queue_mutex_.unlock();
        };
        config.host = std::move(host);
    }
    const std::scoped_lock lock(instance_mutex());
    return mray::gpu::make_vulkan_backend(config);
#else
    throw Error(ErrorCode::unavailable, "Vulkan: this library is built without it");
#endif
}

std::unique_ptr<mray::Backend> DeviceImpl::make_backend() {
    const mray::cpu::CpuConfig config{.threads = cpu_.threads, .simd = cpu_.simd};
    if (kind_ == Kind::cpu) return mray::cpu::make_cpu_backend(config);
    if (kind_ == Kind::brute) return mray::cpu::make_brute_backend(config);
    return make_vulkan_backend();
}

std::unique_ptr<mray::Backend> DeviceImpl::take_backend() {
    {
        const std::scoped_lock lock(mutex_);
        if (!idle_.empty()) {
            std::unique_ptr<mray::Backend> backend = std::move(idle_.back());
            idle_.pop_back();
            return backend;
        }
    }
    return make_backend();
}

void DeviceImpl::give_back(std::unique_ptr<mray::Backend> backend) noexcept {
    if (kind_ != Kind::vulkan) return;
    try {
        // Frees the scene's memory, and fails for a device that is lost.
        backend->set_scene({}, {}, mray::build_bvh({}, {}));
        const std::scoped_lock lock(mutex_);
        idle_.push_back(std::move(backend));
    } catch (...) {
        // The backend is destroyed; the next scene gets a new one.
    }
}

Device DeviceImpl::make(Kind kind, const CpuOptions& cpu, const VulkanOptions& vulkan,
                        const VulkanHost& host) {
    return with_public_errors([&] {
        if (cpu.threads < 0) throw_bad_argument("threads: must not be negative");
        return Device(std::make_shared<DeviceImpl>(kind, cpu, vulkan, host));
    });
}

DeviceBackend take_backend(const Device& device) {
    DeviceImpl& impl = DeviceImpl::of(device);
    return {impl.take_backend().release(), GiveBack{&impl}};
}

}  // namespace detail

using detail::DeviceImpl;

Device::Device(std::shared_ptr<DeviceImpl> impl) : impl_(std::move(impl)) {}

Device Device::cpu(const CpuOptions& options) {
    return DeviceImpl::make(DeviceImpl::Kind::cpu, options, {});
}

Device Device::vulkan(const VulkanOptions& options) {
    return DeviceImpl::make(DeviceImpl::Kind::vulkan, {}, options);
}

Device Device::adopt(const VulkanHost& host) {
    return detail::with_public_errors([&] {
        if (host.instance == nullptr || host.physical_device == nullptr || host.device == nullptr ||
            host.queue == nullptr) {
            detail::throw_bad_argument("VulkanHost: a handle is null");
        }
        return DeviceImpl::make(DeviceImpl::Kind::vulkan, {}, {}, host);
    });
}

Device Device::brute_force(const CpuOptions& options) {
    return DeviceImpl::make(DeviceImpl::Kind::brute, options, {});
}

const std::string& Device::name() const { return impl_->name(); }
std::string Device::description() const { return impl_->description(); }

std::vector<std::string> simd_targets() {
    return detail::with_public_errors([] {
        std::vector<std::string> names;
        for (const mray::SimdTarget& target : mray::supported_simd_targets())
            names.emplace_back(target.name);
        return names;
    });
}

std::vector<VulkanDeviceInfo> vulkan_devices() {
    return detail::with_public_errors([]() -> std::vector<VulkanDeviceInfo> {
#ifdef MORPHRAY_HAS_VULKAN
        const std::scoped_lock lock(instance_mutex());
        std::vector<VulkanDeviceInfo> infos;
        for (const mray::gpu::DeviceInfo& info : mray::gpu::list_devices()) {
            infos.push_back({info.index, info.name, info.type, info.driver, info.uuid,
                             info.api_major, info.api_minor, info.memory_bytes, info.subgroup_size,
                             info.unusable});
        }
        return infos;
#else
        throw Error(ErrorCode::unavailable, "Vulkan: this library is built without it");
#endif
    });
}

}  // namespace morphray
