// What a refit to the next pose has to write.
#pragma once

#include <optional>
#include <span>

#include "common/backend.h"
#include "common/update/moved_parts.h"

namespace morphray {

/// Everything, or what moved; nothing if that is nothing.
struct RefitPlan {
    bool all = false;
    MovedParts parts = {};
    /// Of the leaves, those that are written.
    std::uint64_t leaf_count = 0;
};

/// Follows the poses of a scene for a backend that keeps one tree at a time.
class RefitPlanner {
public:
    RefitPlanner() = default;
    /// At the start of a scene.
    explicit RefitPlanner(std::span<const vec3> positions) : pose_(positions) {}

    const PoseMemory& pose() const { return pose_; }

    /// Another pose with a tree that belongs to it.
    void set_frame(std::span<const vec3> positions);
    /// Another tree at the same pose.
    void set_tree() { block_leaves_.reset(); }
    /// The next pose, for the tree of the last set_frame() or of the start. Of the tree only
    /// leaf_vertices and parents are looked at.
    void advance(std::span<const vec3> positions) { moved_blocks_ = pose_.advance(positions); }
    RefitPlan plan(const Bvh& tree, RefitExtent extent);

private:
    PoseMemory pose_;
    std::uint32_t moved_blocks_ = 0;
    /// Made when it is first of use to a tree.
    std::optional<BlockLeaves> block_leaves_;
};

/// Indices [begin, end).
struct IndexRange {
    std::uint32_t begin = 0;
    std::uint32_t end = 0;
    bool operator==(const IndexRange&) const = default;
};

/// At most `most` ranges that cover the ascending indices: where there would be more, gaps are
/// filled, the smallest first. `most` is at least 1.
std::vector<IndexRange> covering_ranges(std::span<const std::uint32_t> indices, std::size_t most);

}  // namespace morphray
