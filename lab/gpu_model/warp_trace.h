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

/// What the lanes of a warp do at once. No kernel has all of them.
enum class StepKind : std::uint8_t {
    kBegin,     // makes the rays and stores the answers
    kNode,      // meets all boxes of a node; in the present kernels those of its quarters
    kQuarter,   // meets four boxes of a node
    kChildren,  // loads the children of a quarter
    kChild,     // considers one of them
    kPush,
    kPop,
    kLeaf,  // enters a leaf and leaves it
    kGroups,
    kTriangle,
    kHit,   // finds the depth of a triangle that may be met
    kOpen,  // decides a triangle by the whole rule
};
inline constexpr std::size_t kStepKinds = 12;

struct Step {
    StepKind kind;
    std::uint8_t active;
    /// Cycles of a first cache that reads a line and fills 128 bytes of registers in each.
    std::uint32_t wavefronts;
    /// Its sectors end here in WarpTrace::sectors, and begin where those of the step before end.
    std::uint32_t sectors_end;
};

/// A sector of 32 bytes of the stacks, which is the warp's own.
inline constexpr std::uint64_t kStackSector = std::uint64_t{1} << 40;

struct WarpTrace {
    std::vector<Step> steps;
    std::vector<std::uint64_t> sectors;
    std::uint32_t rays = 0, hits = 0;
    /// Rays and their triangles that are left to `decide`.
    std::uint32_t open_rays = 0, open_triangles = 0;
    /// What the rays met, or not.
    std::uint32_t boxes = 0, triangles = 0;
};

enum class KernelForm {
    /// Of revision 79d57a95: all boxes of a node, an entry of the stack written for each, first all
    /// triangles of a leaf and then hits, the whole rule in the same kernel.
    kFirst,
    /// Quarters and groups, pushes of what is met, open triangles left to `decide`.
    kPresent,
};

/// Traces up to 32 rays as a kernel over the shared layout does.
WarpTrace trace_warp(const Bvh& bvh, std::span<const Ray> rays, bool any_hit, KernelForm form);

/// The same over the peer's tree, by one loop in which a leaf is a node (tinybvh 1.9.1, whose
/// triangles are found by an index).
WarpTrace trace_warp(const PeerTree& tree, std::span<const Ray> rays, bool any_hit);

}  // namespace mray::lab
