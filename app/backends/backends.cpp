#include "app/backends/backends.h"

#include <fmt/format.h>

#include "app/terminal/failure.h"
#include "cpu/cpu_backend.h"
#include "gpu/vulkan_backend.h"

namespace mray::app {
namespace {

std::unique_ptr<Backend> make_unwatched(BackendChoice choice, const BackendOptions& options) {
    const cpu::CpuConfig config{.threads = options.threads, .simd = options.simd};
    if (choice == BackendChoice::kCpu) return cpu::make_cpu_backend(config);
    if (choice == BackendChoice::kBrute) return cpu::make_brute_backend(config);
    check_vulkan();
#ifdef MORPHRAY_HAS_VULKAN
    require_sound_device(options.device);
    return gpu::make_vulkan_backend({.device = options.device, .validate = options.validate});
#else
    return nullptr;
#endif
}

std::unique_ptr<Backend> make_concrete(BackendChoice choice, const BackendOptions& options) {
    std::unique_ptr<Backend> backend = make_unwatched(choice, options);
    backend->watch_images(Watch(&interrupt_flag()));
    return backend;
}

}  // namespace

bool asks_for_vulkan(const BackendOptions& options) {
    return !options.device.empty() || options.validate;
}

bool is_lack_of_vulkan(const Error& error) {
    return error.kind() == ErrorKind::kUnavailable || error.kind() == ErrorKind::kLimit ||
           error.kind() == ErrorKind::kDeviceLost;
}

bool has_only_software_devices() {
    bool any = false;
    try {
        for (const morphray::VulkanDeviceInfo& device : vulkan_devices()) {
            if (!device.unusable.empty()) continue;
            if (device.type != "cpu") return false;
            any = true;
        }
    } catch (const Error& error) {
        // make_chosen() warns of the reason.
        if (!is_lack_of_vulkan(error)) throw;
    }
    return any;
}

void check_vulkan() {
#ifndef MORPHRAY_HAS_VULKAN
    throw Error(ErrorKind::kUnavailable,
                "Vulkan: not built in; use --backend cpu, or build with -DMORPHRAY_VULKAN=ON");
#endif
}

std::vector<morphray::VulkanDeviceInfo> vulkan_devices() {
#ifdef MORPHRAY_HAS_VULKAN
    return call_library([] { return morphray::vulkan_devices(); });
#else
    throw Error(ErrorKind::kUnavailable, "Vulkan: not built in; build with -DMORPHRAY_VULKAN=ON");
#endif
}

std::vector<morphray::VulkanDeviceInfo> devices_to_check(const BackendOptions& options) {
    if (options.choice == BackendChoice::kCpu) return {};
    std::vector<morphray::VulkanDeviceInfo> devices = vulkan_devices();
#ifdef MORPHRAY_HAS_VULKAN
    const std::uint32_t chosen = gpu::find_device(options.device).index;
    std::erase_if(devices, [&](const auto& device) { return device.index != chosen; });
#endif
    return devices;
}

std::unique_ptr<Backend> make_backend(BackendChoice choice, const BackendOptions& options,
                                      const Messages& messages) {
    return make_chosen(choice, options, messages,
                       [&](BackendChoice chosen) { return make_concrete(chosen, options); });
}

BuildConfig build_config(const BackendOptions& options) {
    return {.threads = options.threads, .watch = Watch(&interrupt_flag())};
}

std::vector<BackendChoice> profiled_backends(const BackendOptions& options,
                                             const Messages& messages) {
    if (options.choice != BackendChoice::kAuto) return {options.choice};
    try {
        make_concrete(BackendChoice::kVulkan, options);
    } catch (const Error& error) {
        if (asks_for_vulkan(options) || !is_lack_of_vulkan(error)) throw;
        messages.warn({{}, fmt::format("{}; using the CPU instead", error.what())});
        return {BackendChoice::kCpu};
    }
    return {BackendChoice::kCpu, BackendChoice::kVulkan};
}

}  // namespace mray::app
