// The parts of a tree that moved vertices reach: a refit leaves the rest as it is.
#pragma once

#include <optional>

#include "common/backend.h"
#include "common/bvh/bvh.h"
#include "common/scene/mesh.h"
#include "common/scene/pose.h"

namespace mray {

/// Leaves with a moved vertex, and the nodes above them up to the root, each ascending.
struct MovedParts {
    std::vector<std::uint32_t> leaves;
    std::vector<std::uint32_t> nodes;
};

/// The leaves of one tree by the blocks of their vertices: 4 bytes a triangle, a refit's time.
class BlockLeaves {
public:
    /// Reads only leaf_vertices and parents of the tree.
    BlockLeaves(const Bvh& bvh, std::uint32_t block_count);

    /// The parts of the tree that the last move of the pose reaches.
    MovedParts reached(const Bvh& bvh, const Pose& pose) const;

private:
    /// Block b has leaves_[begin_[b] .. begin_[b + 1]).
    std::vector<std::uint32_t> begin_;
    std::vector<std::uint32_t> leaves_;
};

struct RefitPlan {
    /// Whether everything is written; otherwise `parts`, which may be empty.
    bool all = false;
    MovedParts parts = {};
    /// The number of leaves that are written.
    std::uint64_t leaf_count = 0;
};

/// Plans the refit of a tree to the last move of its pose. Reads leaf_vertices and parents of the
/// tree alone. Makes its `block_leaves` if they are needed and not there.
RefitPlan plan_refit(const Bvh& tree, const Pose& pose, RefitExtent extent,
                     std::optional<BlockLeaves>& block_leaves);

/// At most `most` ranges (at least 1) over ascending indices; the smallest gaps are filled.
std::vector<IndexRange> covering_ranges(std::span<const std::uint32_t> indices, std::size_t most);

}  // namespace mray
