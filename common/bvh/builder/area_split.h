// Divides large triangles from small ones.
#pragma once

#include <cstddef>
#include <span>

#include "common/bvh/builder/split.h"

namespace mray {

/// Divides refs as split_binned does, but the larger boxes from the smaller ones, if that costs
/// less than `other`, a split of the same set; otherwise returns a size of 0. It helps where a few
/// boxes are large, as those of walls and beams in a room: then both sides of any plane have large
/// boxes. triangles: how many the set has. largest: an upper bound of the areas of its boxes, which
/// this may lower to the largest area.
PartSize split_by_area(std::span<const PrimRef> refs, PrimRef* out, std::size_t triangles,
                       const PartSize& other, float& largest);

/// The largest area of a box; 0 for no refs.
float largest_area(std::span<const PrimRef> refs);

}  // namespace mray
