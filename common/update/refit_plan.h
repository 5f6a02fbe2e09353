// The parts of a tree that moved vertices reach, so that a refit can leave the rest as it is.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/backend.h"
#include "common/bvh/bvh.h"
#include "common/scene/mesh.h"

namespace mray {

/// Vertices are compared in blocks of this many: three cache lines. Smaller blocks gain nothing.
inline constexpr std::uint32_t kMotionBlock = 16;

/// The positions of the last pose, and the blocks that moved since the pose before.
class PoseMemory {
public:
    PoseMemory() = default;
    explicit PoseMemory(std::span<const vec3> positions);

    std::span<const vec3> positions() const { return positions_; }
    std::uint32_t block_count() const { return static_cast<std::uint32_t>(moved_.size()); }

    /// Takes the next pose; vertices outside of `changed` (ascending ranges) are the same and not
    /// read. Returns the number of blocks that moved: with a vertex that differs in any bit. Runs
    /// in the calling thread's arena.
    std::uint32_t advance(std::span<const vec3> positions,
                          std::span<const IndexRange> changed = kAllIndices);
    /// The blocks that moved in the last advance(), ascending.
    std::vector<std::uint32_t> moved_blocks() const;

private:
    std::uint32_t take_over(std::span<const vec3> positions, IndexRange blocks);

    std::vector<vec3> positions_;
    std::vector<std::uint8_t> moved_;
};

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

    /// The parts of the tree that the last advance() of the pose reaches.
    MovedParts reached(const Bvh& bvh, const PoseMemory& pose) const;

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

/// Follows the poses of a scene for a backend that keeps one tree at a time.
class RefitPlanner {
public:
    RefitPlanner() = default;
    /// Starts at the first pose of a scene.
    explicit RefitPlanner(std::span<const vec3> positions) : pose_(positions) {}

    const PoseMemory& pose() const { return pose_; }

    /// Takes another pose, with another tree.
    void set_frame(std::span<const vec3> positions) {
        pose_.advance(positions);
        set_tree();
    }
    /// Takes another tree at the same pose.
    void set_tree() { block_leaves_.reset(); }
    /// Takes the next pose, as PoseMemory::advance().
    void advance(std::span<const vec3> positions,
                 std::span<const IndexRange> changed = kAllIndices) {
        moved_blocks_ = pose_.advance(positions, changed);
    }
    /// Plans the refit to the last advance(). Reads leaf_vertices and parents of the tree alone.
    RefitPlan plan(const Bvh& tree, RefitExtent extent);

private:
    PoseMemory pose_;
    std::uint32_t moved_blocks_ = 0;
    /// Made at the first plan() of a tree that needs it.
    std::optional<BlockLeaves> block_leaves_;
};

/// At most `most` ranges (at least 1) over ascending indices; the smallest gaps are filled.
std::vector<IndexRange> covering_ranges(std::span<const std::uint32_t> indices, std::size_t most);

}  // namespace mray
