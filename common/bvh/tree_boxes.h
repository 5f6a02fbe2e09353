// The boxes of a tree at one depth.
#pragma once

#include <cstdint>
#include <vector>

#include "common/bvh/box.h"
#include "common/bvh/bvh.h"

namespace mray {

/// At 0 the box around everything, at 1 those of the root's children, and so on, without empty
/// ones. Leaves above the depth are left out; there is nothing below the tree.
std::vector<Box> boxes_at_depth(const Bvh& bvh, std::uint32_t depth);

}  // namespace mray
