// The work "vulkan": morphray on a Vulkan device beside the peer on the same device.
#pragma once

#include <functional>
#include <string>

#include "lab/bench/bench_scene.h"
#include "lab/bench/row.h"

namespace mray::bench {

/// Camera rays, shadow rays, ambient occlusion, diffuse rays; refit, beside a copy of as many bytes
/// on the device; and the frame: positions up, refit, camera and shadow rays, pixels down. Each by
/// the clock of the device and by that of the wall. Mismatches are the rays that hit another
/// triangle than the peer's, whose rule is another. Throws Error(kUnavailable) without a device.
void bench_vulkan(const BenchScene& scene, int repeat,
                  const std::function<void(const Row&)>& report);

/// The name and driver of the device.
std::string device_line();

}  // namespace mray::bench
