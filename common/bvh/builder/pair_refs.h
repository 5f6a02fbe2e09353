// Refs that stand for two triangles each, such as the halves of a quadrangle: they halve the work
// of the splits.
#pragma once

#include <cstddef>
#include <span>

#include "common/base/watch.h"
#include "common/bvh/builder/split.h"

namespace mray {

/// Makes pairs of neighbours in the list that share one edge and whose common box is small; the
/// others stay as they are. refs are triangles of the topology, each the one after the last.
/// Returns how many refs are left, at the beginning and in order.
std::size_t pair_refs(const Topology& topology, std::span<PrimRef> refs);

/// Makes the refs of all triangles, which are the same for any number of threads, in one of two
/// arrays with room for a ref a triangle; returns them. Throws Error(kCancelled) soon after the
/// watch asks for it.
std::span<PrimRef> make_paired_refs(const Topology& topology, std::span<const vec3> positions,
                                    PrimRef* first, PrimRef* second, const SimdTarget& target,
                                    const Watch& watch);

/// Makes single refs of refs[0 .. count), all of triangles, which have room for a ref a triangle.
void open_pairs(const Topology& topology, std::span<const vec3> positions, PrimRef* refs,
                std::size_t count, std::size_t triangles, const SimdTarget& target);

}  // namespace mray
