// What of a tree the vertices that have moved reach, so that a refit can leave the rest alone.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/bvh/bvh.h"

namespace morphray {

/// Vertices are watched in blocks of so many: 192 bytes, three cache lines. Of animals on a static
/// ground that is fine enough to lose nothing, and the blocks of a leaf are few.
inline constexpr std::uint32_t kMotionBlock = 16;

/// The positions of the last pose, and which blocks the one before differed in.
class PoseMemory {
public:
    PoseMemory() = default;
    explicit PoseMemory(std::span<const vec3> positions);

    std::span<const vec3> positions() const { return positions_; }
    std::uint32_t block_count() const { return static_cast<std::uint32_t>(moved_.size()); }

    /// Takes over the next pose (as many vertices). Returns how many blocks have a vertex that
    /// differs in any bit. Runs in the calling thread's arena.
    std::uint32_t advance(std::span<const vec3> positions);
    /// Whether the block differed in the last advance().
    bool moved(std::uint32_t block) const { return moved_[block] != 0; }
    /// Those that did, ascending.
    std::vector<std::uint32_t> moved_blocks() const;

private:
    std::vector<vec3> positions_;
    std::vector<std::uint8_t> moved_;
};

/// Leaves and nodes, ascending: leaves with a moved vertex, and the nodes that hold a box of one of
/// those, up to the root.
struct MovedParts {
    std::vector<std::uint32_t> leaves;
    std::vector<std::uint32_t> nodes;
};

/// The leaves of one tree by the blocks of their vertices. Some 4 bytes a triangle; making it takes
/// about as long as a refit.
class BlockLeaves {
public:
    /// Looks at the tree's leaf_vertices and parents alone.
    BlockLeaves(const Bvh& bvh, std::uint32_t block_count);

    /// The parts of that tree that the pose's last advance() reaches.
    MovedParts reached(const Bvh& bvh, const PoseMemory& pose) const;

private:
    /// Those of block b: leaves_[begin_[b] .. begin_[b + 1]).
    std::vector<std::uint32_t> begin_;
    std::vector<std::uint32_t> leaves_;
};

}  // namespace morphray
