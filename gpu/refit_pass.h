// A refit on the device.
#pragma once

#include "common/update/refit_plan.h"
#include "gpu/kernels.h"
#include "gpu/scene_buffers.h"

namespace morphray::gpu {

/// Hands over the positions of the pose, those that moved or all where the plan says so. Returns
/// what refits by the plan, and some of what lies between: that is written again as it was. Nothing
/// if there is nothing to do. What is returned is meant for the scene as it is.
Record refit_scene(Context& context, const Kernels& kernels, SceneBuffers& scene,
                   const PoseMemory& pose, const RefitPlan& plan);

/// Likewise, of everything, at a pose between keyframes that are on the device.
Record refit_scene(Context& context, const Kernels& kernels, SceneBuffers& scene,
                   const KeyframePose& pose);

}  // namespace morphray::gpu
