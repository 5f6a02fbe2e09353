// What warps of 32 rays do in a kernel that traces one ray a lane: its control flow in lockstep, as
// steps, and the memory that each of them touches.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/bvh/bvh.h"
#include "common/interop/ray.h"
#include "lab/methods/peer_tree.h"

namespace mray::lab {

inline constexpr std::uint32_t kWarpLanes = 32;
/// A sector of 32 bytes of the stacks, which is the warp's own.
inline constexpr std::uint64_t kStackSector = std::uint64_t{1} << 40;

/// What the lanes of a warp do at once. No kernel has all of them.
enum class StepKind : std::uint8_t {
    kBegin,    // makes the rays and stores the answers
    kNode,     // meets the boxes of a node, in the present kernels those of its quarters
    kQuarter,  // meets four boxes of a node, and loads its children
    kPush,     // considers one of them
    kPop,
    kLeaf,  // enters a leaf and leaves it
    kGroups,
    kTriangle,
    kHit,  // finds the depth of a triangle that may be met
};
inline constexpr std::size_t kStepKinds = 9;

struct Step {
    StepKind kind;
    std::size_t active;
    /// Cycles of a first cache that reads a line and fills 128 bytes of registers in each.
    std::size_t wavefronts = 0;
    /// Each once, in the order of the loads.
    std::vector<std::uint64_t> sectors = {};
};

struct WarpTrace {
    std::vector<Step> steps;
    std::uint32_t hits = 0;
    /// Boxes that rays met, or not.
    std::uint32_t boxes = 0;
    /// Triangles that the present kernels leave to `decide`.
    std::uint32_t open = 0;
};

/// Traces up to 32 rays: over a Bvh as the present kernels do, by quarters and groups; over a
/// PeerTree as tinybvh 1.9.1 does, by one loop in which a leaf is a node.
template <class Tree>
WarpTrace trace_warp(const Tree& tree, std::span<const Ray> rays, bool any_hit);

}  // namespace mray::lab
