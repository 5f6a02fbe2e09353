// Queries about all triangles of a scene on the device.
#pragma once

#include "common/scene_queries.h"
#include "gpu/kernels.h"
#include "gpu/ray_passes.h"
#include "gpu/scene_buffers.h"

namespace mray::gpu {

/// Answers queries without a filter that are not is_for_host(): one call at a time, with the tree
/// at its pose and ray buffers in use.
void answer(const QueryBatch& batch, Transfer& transfer, Kernels& kernels, RayPasses& passes,
            const SceneBuffers& scene);

}  // namespace mray::gpu
