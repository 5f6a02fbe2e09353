// The self-test of a Vulkan device.
#pragma once

#include <optional>
#include <string>

#include "common/backend.h"
#include "morphray/device.hpp"

namespace morphray::detail {

/// Has both backends trace, shade and refit a small scene. Returns what differs first in the tested
/// one, such as "closest hits"; empty if all bits are equal. Throws what the backends throw.
std::string find_difference(mray::Backend& tested, mray::Backend& reference);

/// Throws Error if the device that `options` name fails its self-test, which it makes now if no
/// result is kept.
void require_sound_device(const VulkanOptions& options);

}  // namespace morphray::detail
