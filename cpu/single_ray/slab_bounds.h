// Constants of the slab test of rays on lanes, which depend on whether products are fused
// (cpu/single_ray/node_lanes-inl.h). The others are in common/interop/constants.h.
#pragma once

namespace mray::cpu {

/// The dilation of boxes by |org| on each axis where products are rounded before they are added;
/// else it is kDilationOfOrigin. Checked: lab/proofs/near.g.
inline constexpr float kUnfusedDilation = 0x3p-24f;

/// How much farther slabs end than computed where products are fused; else it is kSlabRounding.
/// Checked: lab/proofs/near.g.
inline constexpr float kFusedSlabRounding = 0x1.000006p0f;

}  // namespace mray::cpu
