// Makes the backends that the options choose. Nothing else knows whether Vulkan was built in.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "app/base/options.h"
#include "app/terminal/messages.h"
#include "common/backend.h"
#include "common/base/errors.h"
#include "common/bvh/builder/bvh_builder.h"
#include "morphray/device.hpp"
#include "scenes/scene_frames.h"

namespace mray::app {

/// morphray::vulkan_devices(); throws Error(kUnavailable) without Vulkan.
std::vector<morphray::VulkanDeviceInfo> vulkan_devices();

/// None if the options choose the CPU. Throws Error(kUnavailable).
std::vector<morphray::VulkanDeviceInfo> devices_to_check(const BackendOptions& options);

bool asks_for_vulkan(const BackendOptions& options);
bool is_lack_of_vulkan(const Error& error);
/// Whether the only usable Vulkan devices run on the CPU, where the CPU backend is faster.
bool has_only_software_devices();

/// Throws Error if Vulkan is not built in, or if there is too little memory for a driver to start.
void check_vulkan();
/// Throws Error if the device failed its self-test, which is made now if no result is kept.
void require_sound_device(const std::string& device);

// The self-test of Vulkan devices, in a process of its own: a device that hangs takes that one with
// it (app/backends/device_check.cpp).

/// Lets the tests below start this program again. Without it they run in this process.
void allow_check_in_child();

/// Tests the device that BackendOptions::device names, and keeps the result.
morphray::DeviceCheck check_device(const std::string& device);

bool is_check_child();

/// Calls make(choice) for kCpu, kVulkan or kBrute. kAuto is Vulkan if there is a GPU or the options
/// ask for a device; else it is the CPU, with a note or a warning.
template <class Make>
auto make_chosen(BackendChoice choice, const BackendOptions& options, const Messages& messages,
                 Make make) {
    if (choice != BackendChoice::kAuto) return make(choice);
    if (asks_for_vulkan(options)) return make(BackendChoice::kVulkan);
    if (has_only_software_devices()) {
        messages.note("no GPU; --backend vulkan takes the device that runs on the CPU");
        return make(BackendChoice::kCpu);
    }
    try {
        return make(BackendChoice::kVulkan);
    } catch (const Error& error) {
        if (!is_lack_of_vulkan(error)) throw;
        messages.warn({{}, std::string(error.what()) + "; using the CPU instead"});
        return make(BackendChoice::kCpu);
    }
}

std::unique_ptr<Backend> make_backend(BackendChoice choice, const BackendOptions& options,
                                      const Messages& messages);

BuildConfig build_config(const BackendOptions& options);

/// The chosen backend; for kAuto the CPU and, if it is available, Vulkan.
std::vector<BackendChoice> profiled_backends(const BackendOptions& options,
                                             const Messages& messages);

}  // namespace mray::app
