// A refit on the device.
#pragma once

#include "common/update/refit_plan.h"
#include "gpu/kernels.h"
#include "gpu/scene_buffers.h"

namespace mray::gpu {

/// Hands over the positions that the plan needs: those that moved, or all. Returns commands that
/// refit by the plan, for the scene as it is now; nothing if there is nothing to do. Some leaves
/// and nodes between those of the plan are written again, with the same bytes.
Record refit_scene(Context& context, const Kernels& kernels, SceneBuffers& scene,
                   const PoseMemory& pose, const RefitPlan& plan);

}  // namespace mray::gpu
