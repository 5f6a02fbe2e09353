// The parts of a tree that moved vertices reach, so that a refit can leave the rest as it is.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/bvh/bvh.h"

namespace mray {

/// Vertices are compared in blocks of this many: 192 bytes, three cache lines. For animals on a
/// static ground smaller blocks gain nothing, and a leaf has few blocks.
inline constexpr std::uint32_t kMotionBlock = 16;

/// The positions of the last pose, and the blocks that moved since the pose before.
class PoseMemory {
public:
    PoseMemory() = default;
    explicit PoseMemory(std::span<const vec3> positions);

    std::span<const vec3> positions() const { return positions_; }
    std::uint32_t block_count() const { return static_cast<std::uint32_t>(moved_.size()); }

    /// Takes the next pose, with as many vertices. Returns the number of blocks that moved: with a
    /// vertex that differs in any bit. Runs in the calling thread's arena.
    std::uint32_t advance(std::span<const vec3> positions);
    /// Whether the block moved in the last advance().
    bool moved(std::uint32_t block) const { return moved_[block] != 0; }
    /// The blocks that moved, ascending.
    std::vector<std::uint32_t> moved_blocks() const;

private:
    std::vector<vec3> positions_;
    std::vector<std::uint8_t> moved_;
};

/// Leaves with a moved vertex, and the nodes above them up to the root, each ascending.
struct MovedParts {
    std::vector<std::uint32_t> leaves;
    std::vector<std::uint32_t> nodes;
};

/// The leaves of one tree by the blocks of their vertices. It takes some 4 bytes a triangle, and
/// about the time of a refit to make.
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

}  // namespace mray
