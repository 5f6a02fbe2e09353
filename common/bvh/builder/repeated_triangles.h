// Triangles that a scene has more than once.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "common/bvh/builder/prim_ref.h"
#include "common/bvh/bvh.h"

namespace mray {

/// Removes refs to triangles that have the three vertices of an earlier one of the set, in the same
/// order, and appends them to `repeated`: they move together, so that one may stand for all. The
/// others keep their order; returns how many they are. refs ascend by prim_id, and all are
/// triangles. Takes time in proportion to the refs and at most 256 KiB besides `repeated`; with
/// more than some ten thousand different triangles it may leave repeated ones in.
std::size_t remove_repeated(const Topology& topology, std::span<PrimRef> refs,
                            std::vector<RepeatedTriangle>& repeated);

}  // namespace mray
