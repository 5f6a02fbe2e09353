// The check of the invariants of a tree.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "common/bvh/bvh.h"
#include "common/scene/mesh.h"

namespace mray::test {

/// Returns a message for each broken invariant, at most `limit`; empty for a sound tree. Checks the
/// breadth-first order and the parents, that each triangle is in exactly one leaf with the right
/// vertices at the right positions (or, instead, one of the same vertices with a lower prim_id),
/// that used slots come before unused ones, and that each slot's box is equal to the bounds of the
/// subtree below it.
std::vector<std::string> check_bvh(const Bvh& bvh, const Topology& topology,
                                   std::span<const vec3> positions, std::size_t limit = 10);

}  // namespace mray::test
