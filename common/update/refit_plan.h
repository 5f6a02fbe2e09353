// The parts of a tree that a refit to the next pose writes.
#pragma once

#include <optional>
#include <span>

#include "common/backend.h"
#include "common/update/moved_parts.h"

namespace mray {

struct RefitPlan {
    /// Whether everything is written; otherwise `parts`, which may be empty.
    bool all = false;
    MovedParts parts = {};
    /// The number of leaves that are written.
    std::uint64_t leaf_count = 0;
};

/// Follows the poses of a scene for a backend that keeps one tree at a time.
class RefitPlanner {
public:
    RefitPlanner() = default;
    /// Starts at the first pose of a scene.
    explicit RefitPlanner(std::span<const vec3> positions) : pose_(positions) {}

    const PoseMemory& pose() const { return pose_; }

    /// Takes another pose, with another tree.
    void set_frame(std::span<const vec3> positions);
    /// Takes another tree at the same pose.
    void set_tree() { block_leaves_.reset(); }
    /// Takes the next pose, with as many vertices.
    void advance(std::span<const vec3> positions) { moved_blocks_ = pose_.advance(positions); }
    /// Plans the refit of the current tree to the last advance(). Reads only leaf_vertices and
    /// parents of the tree.
    RefitPlan plan(const Bvh& tree, RefitExtent extent);

private:
    PoseMemory pose_;
    std::uint32_t moved_blocks_ = 0;
    /// Made at the first plan() of a tree that needs it.
    std::optional<BlockLeaves> block_leaves_;
};

/// Indices [begin, end).
struct IndexRange {
    std::uint32_t begin = 0;
    std::uint32_t end = 0;
    bool operator==(const IndexRange&) const = default;
};

/// At most `most` ranges (at least 1) that cover the ascending indices. If more would be needed, it
/// fills gaps, the smallest first.
std::vector<IndexRange> covering_ranges(std::span<const std::uint32_t> indices, std::size_t most);

}  // namespace mray
