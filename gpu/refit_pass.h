// A refit on the device.
#pragma once

#include "common/refit_plan.h"
#include "gpu/kernels.h"
#include "gpu/scene_buffers.h"

namespace morphray::gpu {

/// Brings the positions on the device to the pose: those that moved, or all where the plan says so.
void upload_positions(SceneBuffers& scene, Transfer& transfer, const PoseMemory& pose,
                      const RefitPlan& plan);

/// Refits what the plan says, and some of what lies between: that is written again as it was.
/// Returns milliseconds.
double refit_scene(Context& context, const Kernels& kernels, const SceneBuffers& scene,
                   const RefitPlan& plan);

}  // namespace morphray::gpu
