// Constants that cover rounding on lanes; others are in common/interop/constants.h.
#pragma once

namespace mray::cpu {

// ---- Slabs, which depend on whether products are fused (cpu/single_ray/node_lanes-inl.h)

/// The dilation of boxes by |org| on each axis where products are fused, and where they are rounded
/// before they are added; and that by least_dilation(): no box begins later than in hits_box, where
/// refined hits begin. Checked: lab/proofs/near.g.
inline constexpr float kFusedDilation = 0x4p-24f;
inline constexpr float kUnfusedDilation = 0x6p-24f;
inline constexpr float kLeastDilations = 2;

/// How much farther slabs end than computed where products are fused; else it is kSlabRounding.
/// Checked: lab/proofs/near.g.
inline constexpr float kFusedSlabRounding = 0x1.000006p0f;

// ---- Closest triangles (cpu/queries/tree_queries-inl.h, lab/proofs/closest.g)

/// The roundings of the bound by the nearest vertex; its squared error, as a part of that of the
/// largest coordinate, and the least.
inline constexpr float kNearestVertexRounding = 1 + 0x1p-14f;
inline constexpr float kNearestVertexErrorSquare = 0x1p-20f;
inline constexpr float kLeastNearestVertexErrorSquare = 0x1p-60f;

/// The factor by which rounding may make the squared distance of a box too large.
inline constexpr float kRivalRounding = 1 + 0x1p-20f;

// ---- Colours (cpu/image/pixel_shader.cpp)

/// Scaled square roots at least this far from the middle between two 8-bit numbers are rounded to
/// the number that encode_channel() gives.
/// Checked: lab/proofs/reciprocals.cpp.
inline constexpr float kRootMargin = 0x1p-12f;

}  // namespace mray::cpu
