// Choosing where to divide a set of triangles.
#pragma once

#include <cstddef>
#include <span>

#include "common/binary_tree.h"

namespace morphray {

/// Each divides refs in two by reordering them, and returns the size of the first part, or 0 where
/// it finds no way (all centroids coincide). Which triangles go where depends on the set alone, not
/// on its order: equal costs are decided by axis, then position; equal centroids by prim_id.

/// Bins over the bounds of the centroids (I. Wald. On fast construction of SAH-based bounding
/// volume hierarchies. 2007).
std::size_t split_binned(std::span<PrimRef> refs);

/// Every position of every axis (Wald, Boulos, Shirley 2007, section 3).
std::size_t split_sweep(std::span<PrimRef> refs);

/// Halves by the order along the widest axis of the centroids: what is left when nothing else
/// works, and bounds the depth. Never 0 for two refs or more.
std::size_t split_median(std::span<PrimRef> refs);

}  // namespace morphray
