// The self-test of Vulkan devices, in a process of its own: a device that hangs takes that one with
// it.
#pragma once

#include <string>

#include "morphray/device.hpp"

namespace mray::app {

/// Lets the tests below start this program again. Without it they run in this process.
void allow_check_in_child();

/// Tests the device that BackendOptions::device names, and keeps the result.
morphray::DeviceCheck check_device(const std::string& device);

/// Throws Error with the problem if the device failed its self-test, which is made now if no result
/// is kept.
void require_sound_device(const std::string& device);

/// Whether this process is the child of a test. It then tests that device alone.
bool is_check_child();

}  // namespace mray::app
