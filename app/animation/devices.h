// Opens the devices that the options choose.
#pragma once

#include "app/base/messages.h"
#include "app/base/options.h"
#include "morphray/device.hpp"

namespace mray::app {

/// morphray::vulkan_devices(); throws Error(kUnavailable) without Vulkan.
std::vector<morphray::VulkanDeviceInfo> vulkan_devices();

/// Opens a device. kAuto is Vulkan if there is a GPU or the options ask for a device; else it is
/// the CPU, with a note or a warning. Throws Error.
morphray::Device open_device(const BackendOptions& options, const Messages& messages);
/// For kAuto the CPU and, if it is available, Vulkan.
std::vector<morphray::Device> open_devices(const BackendOptions& options, const Messages& messages);

BuildConfig build_config(const BackendOptions& options);

// The self-test of Vulkan devices, in a process of its own, so that a device that hangs ends that
// one alone.

/// Lets check_device() start this program again; otherwise the test runs in this process. Returns
/// true, after the test, in the process that was started for it.
bool run_check_child(int argc, char** argv);

/// Tests the device that BackendOptions::device names, and keeps the result.
morphray::DeviceCheck check_device(const std::string& device);

}  // namespace mray::app
