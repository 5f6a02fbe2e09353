#include "library/src/device_impl.h"

#include "common/version.h"
#include "cpu/cpu_backend.h"
#include "library/src/engine.h"
#include "library/src/scene/errors.h"
#include "morphray/version.hpp"
#ifdef MORPHRAY_HAS_VULKAN
#include "gpu/vulkan_backend.h"
#include "library/src/self_test.h"
#endif

namespace morphray {
namespace detail {

#ifdef MORPHRAY_HAS_VULKAN
namespace {

/// Makes backends on one device, or on another one once that is lost.
DeviceImpl::MakeBackend vulkan_backends(const VulkanOptions& options) {
    struct State {
        std::mutex mutex;
        std::shared_ptr<mray::gpu::SharedDevice> device;
    };
    return [options, state = std::make_shared<State>()] {
        const std::scoped_lock lock(state->mutex);
        if (state->device == nullptr || mray::gpu::is_lost(*state->device))
            state->device =
                mray::gpu::open_device({.device = options.device, .validate = options.validate});
        return mray::gpu::make_backend_on(state->device);
    };
}

}  // namespace
#endif

DeviceImpl::DeviceImpl(MakeBackend make, const CpuOptions& host)
    : make_backend(std::move(make)),
      threads(host.threads),
      arena(host.threads),
      simd_target(mray::find_simd_target(host.simd == mray::kSimdOff ? "scalar" : host.simd)) {
    const std::unique_ptr<mray::Backend> backend = make_backend();
    name = backend->info().name;
    description = backend->info().description;
}

Device DeviceImpl::make(MakeBackend make, const CpuOptions& host) {
    return with_public_errors([&] {
        if (host.threads < 0) throw_bad_argument("threads: must not be negative");
        return Device(std::make_shared<DeviceImpl>(std::move(make), host));
    });
}

Device DeviceImpl::make_on_device(MakeBackend make) {
    return DeviceImpl::make([make = std::move(make)] {
        return mray::cpu::with_host_answers(make(), mray::best_simd_target());
    });
}

}  // namespace detail

using namespace detail;

const char* version() noexcept { return mray::kVersion.data(); }

Device::Device(std::shared_ptr<DeviceImpl> impl) : impl_(std::move(impl)) {}

template <class Make>
static Device make_on_host(Make make, const CpuOptions& options) {
    return DeviceImpl::make([=] { return make({options.threads, options.simd}); }, options);
}
Device Device::cpu(const CpuOptions& options) {
    return make_on_host(mray::cpu::make_cpu_backend, options);
}
Device Device::brute_force(const CpuOptions& options) {
    return make_on_host(mray::cpu::make_brute_backend, options);
}
const std::string& Device::name() const { return impl_->name; }
std::string Device::description() const { return impl_->description; }

std::vector<std::string> simd_targets() {
    return with_public_errors([] {
        std::vector<std::string> names;
        for (const mray::SimdTarget& target : mray::supported_simd_targets())
            names.emplace_back(target.name);
        return names;
    });
}

#ifdef MORPHRAY_HAS_VULKAN
std::vector<VulkanDeviceInfo> vulkan_devices() {
    return with_public_errors([] {
        std::vector<VulkanDeviceInfo> infos;
        for (const mray::gpu::DeviceInfo& info : mray::gpu::list_devices()) {
            infos.push_back({info.index, info.name, info.type, info.driver, info.uuid,
                             info.api_major, info.api_minor, info.memory_bytes, info.subgroup_size,
                             info.unusable, info.promises_floats});
        }
        return infos;
    });
}

Device Device::vulkan(const VulkanOptions& options) {
    return with_public_errors([&] {
        const mray::gpu::DeviceInfo info = mray::gpu::find_device(options.device);
        const std::optional<DeviceCheck> kept = kept_check(info);
        const DeviceCheck check = kept ? *kept : run_self_test(info);
        if (!check.passed) throw Error(check.code, check.problem);
        return DeviceImpl::make_on_device(vulkan_backends(options));
    });
}

std::uint32_t engine::device_index(const std::string& device) {
    return with_public_errors([&] { return mray::gpu::find_device(device).index; });
}
DeviceCheck check_vulkan_device(const std::string& device) {
    return with_public_errors([&] { return run_self_test(mray::gpu::find_device(device)); });
}
std::optional<DeviceCheck> kept_device_check(const std::string& device) {
    return with_public_errors([&] { return kept_check(mray::gpu::find_device(device)); });
}
DeviceCheck keep_lost_device(const std::string& device, const std::string& what) {
    return with_public_errors(
        [&] { return keep_failure(mray::gpu::find_device(device), ErrorCode::device_lost, what); });
}
#else
[[noreturn]] static void throw_no_vulkan() {
    throw Error(ErrorCode::unavailable, "Vulkan: this library is built without it");
}
Device Device::vulkan(const VulkanOptions&) { throw_no_vulkan(); }
std::vector<VulkanDeviceInfo> vulkan_devices() { throw_no_vulkan(); }
std::uint32_t engine::device_index(const std::string&) { throw_no_vulkan(); }
DeviceCheck check_vulkan_device(const std::string&) { throw_no_vulkan(); }
std::optional<DeviceCheck> kept_device_check(const std::string&) { throw_no_vulkan(); }
DeviceCheck keep_lost_device(const std::string&, const std::string&) { throw_no_vulkan(); }
#endif

}  // namespace morphray
