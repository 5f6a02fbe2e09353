// SAH construction of the shared layout.
#pragma once

#include "common/base/watch.h"
#include "common/bvh/bvh.h"
#include "common/scene/mesh.h"
#include "common/simd/simd_target.h"

namespace mray {

struct BuildConfig {
    /// 0: one for each processor. The tree is the same for any number.
    int threads = 0;
    /// The tree is the same for any target.
    SimdTarget target = best_simd_target();
    Watch watch = {};
};

/// Builds a tree over all triangles of the topology at these positions (scene space, one per
/// vertex). Any input builds: no triangles, coinciding ones, vertices that are not finite
/// (kInvalidCoordinate, left out of all boxes). Throws Error(kLimit) above 2^28 triangles, and
/// Error(kCancelled) within a few thousand triangles after the watch asks for it.
Bvh build_bvh(const Topology& topology, std::span<const vec3> positions,
              const BuildConfig& config = {});

}  // namespace mray
