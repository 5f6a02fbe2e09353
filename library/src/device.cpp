#include "morphray/device.hpp"

#include <utility>

#include "common/base/errors.h"
#include "common/simd/simd_target.h"
#include "common/version.h"
#include "library/src/device_impl.h"
#include "library/src/scene/errors.h"
#include "morphray/version.hpp"
#ifdef MORPHRAY_HAS_VULKAN
#include "gpu/vulkan_backend.h"
#endif

namespace morphray {
namespace detail {

DeviceImpl::DeviceImpl(Kind kind, const CpuOptions& cpu, const VulkanOptions& vulkan)
    : kind_(kind),
      cpu_(cpu),
      vulkan_(vulkan),
      arena_(cpu.threads),
      simd_target_(mray::find_simd_target(cpu.simd == mray::kSimdOff ? "scalar" : cpu.simd)) {
#ifdef MORPHRAY_HAS_VULKAN
    if (kind_ == Kind::vulkan) {
        const std::optional<DeviceCheck> kept = kept_device_check(vulkan_.device);
        const DeviceCheck check = kept ? *kept : check_vulkan_device(vulkan_.device);
        if (!check.passed) throw Error(check.code, check.problem);
    }
#endif
    std::unique_ptr<mray::Backend> backend = make_backend();
    name_ = backend->info().name;
    description_ = backend->info().description;
}

#ifdef MORPHRAY_HAS_VULKAN
std::shared_ptr<mray::gpu::SharedDevice> DeviceImpl::open_vulkan_device() {
    const std::scoped_lock lock(mutex_);
    if (shared_ == nullptr || mray::gpu::is_lost(*shared_)) {
        shared_ = mray::gpu::open_device({.device = vulkan_.device, .validate = vulkan_.validate});
    }
    return shared_;
}
#endif

std::unique_ptr<mray::Backend> DeviceImpl::make_backend() {
    const mray::cpu::CpuConfig config{.threads = cpu_.threads, .simd = cpu_.simd};
    if (kind_ == Kind::cpu) return mray::cpu::make_cpu_backend(config);
    if (kind_ == Kind::brute) return mray::cpu::make_brute_backend(config);
#ifdef MORPHRAY_HAS_VULKAN
    return mray::gpu::make_backend_on(open_vulkan_device());
#else
    throw Error(ErrorCode::unavailable, "Vulkan: this library is built without it");
#endif
}

Device DeviceImpl::make(Kind kind, const CpuOptions& cpu, const VulkanOptions& vulkan) {
    return with_public_errors([&] {
        if (cpu.threads < 0) throw_bad_argument("threads: must not be negative");
        return Device(std::make_shared<DeviceImpl>(kind, cpu, vulkan));
    });
}

}  // namespace detail

using detail::DeviceImpl;

const char* version() noexcept { return mray::kVersion.data(); }

Device::Device(std::shared_ptr<DeviceImpl> impl) : impl_(std::move(impl)) {}

Device Device::cpu(const CpuOptions& options) {
    return DeviceImpl::make(DeviceImpl::Kind::cpu, options, {});
}

Device Device::vulkan(const VulkanOptions& options) {
    return DeviceImpl::make(DeviceImpl::Kind::vulkan, {}, options);
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
