// Refitting a tree of constant topology to moved vertices on the CPU.
#pragma once

#include <span>

#include "common/bvh/bvh.h"
#include "common/simd/simd_target.h"
#include "common/update/refit_plan.h"

namespace mray::cpu {

/// Gives every leaf its new vertex positions (scene space) and every slot its new box, leaves
/// first, then level by level up (I. Wald, S. Boulos, P. Shirley. Ray Tracing Deformable Scenes
/// Using Dynamic Bounding Volume Hierarchies. ACM TOG 26(1), 2007, section 4). The bytes are the
/// same for any number of threads and any target, and equal to those of a build if the positions
/// are. Runs in the calling thread's arena.
void refit(Bvh& bvh, std::span<const vec3> positions,
           const SimdTarget& target = best_simd_target());

/// Refits `parts` of a tree whose others have these positions: the bytes of a whole refit.
void refit(Bvh& bvh, std::span<const vec3> positions, const MovedParts& parts,
           const SimdTarget& target = best_simd_target());

}  // namespace mray::cpu
