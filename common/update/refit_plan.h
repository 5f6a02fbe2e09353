// A pose, and the parts of a tree that its moved vertices reach: a refit leaves the rest as it is.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "common/backend.h"
#include "common/bvh/bvh.h"
#include "common/scene/body.h"
#include "common/scene/mesh.h"

namespace mray {

/// Vertices are compared in blocks of this many: three cache lines. Smaller blocks gain nothing.
inline constexpr std::uint32_t kMotionBlock = 16;

/// The positions of a scene in scene space, which backends borrow, and the blocks of vertices that
/// the last move changed.
class Pose {
public:
    /// No block has moved.
    explicit Pose(std::vector<vec3> positions = {})
        : positions_(std::move(positions)),
          moved_((positions_.size() + kMotionBlock - 1) / kMotionBlock) {}

    std::span<const vec3> positions() const { return positions_; }
    std::uint32_t block_count() const { return static_cast<std::uint32_t>(moved_.size()); }
    /// The blocks that moved since begin_move(), ascending; and their number.
    std::vector<std::uint32_t> moved_blocks() const;
    std::uint32_t moved_count() const;

    /// Begins a move: no block has moved.
    void begin_move() {
        std::ranges::fill(moved_, std::uint8_t{0});
        bodies_.clear();
    }
    /// Overwrites vertices first, first + 1, ...; blocks move if a vertex differs in any bit.
    /// Threads may write different vertices at the same time.
    void write(std::size_t first, std::span<const vec3> positions);
    /// Adds a body whose vertices have been written, unless none of its blocks has moved. Bodies
    /// come in ascending order of vertices; their rest positions must stay until the next move.
    void add_body(const Body& body);
    void forget_bodies() { bodies_.clear(); }
    /// The bodies of the last move.
    std::span<const Body> bodies() const { return bodies_; }
    /// Moves to as many positions, in the calling thread's arena.
    void move_to(std::span<const vec3> positions);

private:
    std::vector<vec3> positions_;
    std::vector<std::uint8_t> moved_;
    std::vector<Body> bodies_;
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
