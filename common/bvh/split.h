// Choosing where to divide a set of triangles.
#pragma once

#include <cstddef>
#include <span>

#include "common/bvh/prim_ref.h"

namespace morphray {

/// Each divides refs, which ascend by prim_id, in two, writes one part after the other to `out` (as
/// large, elsewhere), each ascending by prim_id, and returns the size of the first, or 0 without
/// writing anything where it finds no way (all centroids coincide). Which triangles go where
/// depends on the set alone: equal costs are decided by axis, then position; equal centroids by
/// prim_id.

/// Bins over the bounds of the centroids (I. Wald. On fast construction of SAH-based bounding
/// volume hierarchies. 2007). Parallel for large sets.
std::size_t split_binned(std::span<const PrimRef> refs, PrimRef* out);

/// Every position of every axis (Wald, Boulos, Shirley 2007, section 3).
std::size_t split_sweep(std::span<const PrimRef> refs, PrimRef* out);

/// The same for at most kFewRefs, many times as fast.
inline constexpr std::size_t kFewRefs = 64;
std::size_t split_few(std::span<const PrimRef> refs, PrimRef* out);

/// The forms for registers of four floats, which are taken where there are none of eight (AVX2).
/// The same results.
std::size_t split_binned_in_four_lanes(std::span<const PrimRef> refs, PrimRef* out);
std::size_t split_few_in_four_lanes(std::span<const PrimRef> refs, PrimRef* out);

/// Halves by the order along the widest axis of the centroids: what is left when nothing else
/// works, and bounds the depth. Never 0 for two refs or more.
std::size_t split_median(std::span<const PrimRef> refs, PrimRef* out);

}  // namespace morphray
