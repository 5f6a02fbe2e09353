// Divides large triangles from small ones.
#pragma once

#include <cstddef>
#include <span>

#include "common/bvh/builder/split.h"

namespace mray {

/// Where a set holds triangles that are large beside its parts, as walls and beams are among small
/// things, no plane divides it well: the boxes of both sides are large. Then this divides it, as
/// split_binned does, in larger and smaller refs, if that costs less than `other`, a split of the
/// same set; otherwise it returns a size of 0. triangles: of the set. largest: a bound of the areas
/// of its boxes, which is made exact where it matters.
PartSize split_by_area(std::span<const PrimRef> refs, PrimRef* out, std::size_t triangles,
                       const PartSize& other, float& largest);

/// The largest area of a box; 0 for no refs.
float largest_area(std::span<const PrimRef> refs);

}  // namespace mray
