// Choosing where to divide a set of triangles.
#pragma once

#include <cstddef>
#include <span>

#include "common/bvh/builder/prim_ref.h"

namespace mray {

// Each function divides refs, which ascend by prim_id, in two, writes one part after the other to
// `out` (as large, elsewhere), each ascending by prim_id, and returns the size of the first. It
// returns 0 and writes nothing where all centroids coincide. Which triangles go where depends on
// the set alone, neither on threads nor on the target: equal costs are decided by axis, then
// position; equal centroids by prim_id.

/// Bins over the bounds of the centroids (I. Wald. On fast construction of SAH-based bounding
/// volume hierarchies. 2007). Parallel for large sets.
std::size_t split_binned(std::span<const PrimRef> refs, PrimRef* out,
                         const SimdTarget& target = best_simd_target());

/// Every position of every axis (Wald, Boulos, Shirley 2007, section 3).
std::size_t split_sweep(std::span<const PrimRef> refs, PrimRef* out,
                        const SimdTarget& target = best_simd_target());

/// split_sweep for at most kFewRefs, many times as fast.
inline constexpr std::size_t kFewRefs = 64;
std::size_t split_few(std::span<const PrimRef> refs, PrimRef* out,
                      const SimdTarget& target = best_simd_target());

/// Halves by the order along the widest axis of the centroids: for sets that the others cannot
/// divide, and to bound the depth. Never 0 for two refs or more.
std::size_t split_median(std::span<const PrimRef> refs, PrimRef* out,
                         const SimdTarget& target = best_simd_target());

}  // namespace mray
