#include "common/update/moved_parts.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cassert>
#include <cstring>
#include <functional>

namespace mray {
namespace {

// Blocks a task: 192 KiB of positions.
constexpr std::uint32_t kGrain = 1024;

// Blocks that are compared at once, 6 KiB. If none of them has moved, this takes 0.6 of the time of
// comparing each.
constexpr std::uint32_t kStretch = 32;

/// Calls `use(block)` once for each block of a leaf's vertices.
template <class Use>
void for_each_block(const Bvh& bvh, std::uint32_t leaf, std::vector<std::uint32_t>& last_leaf,
                    Use use) {
    const std::uint32_t* vertices = &bvh.leaf_vertices[std::size_t{leaf} * kLeafVertices];
    for (std::uint32_t slot = 0; slot < kLeafVertices; ++slot) {
        const std::uint32_t block = vertices[slot] / kMotionBlock;
        if (last_leaf[block] == leaf) continue;
        last_leaf[block] = leaf;
        use(block);
    }
}

std::vector<std::uint32_t> indices_of(const std::vector<std::uint8_t>& flags) {
    std::vector<std::uint32_t> indices;
    std::size_t i = 0;
    for (; i + 8 <= flags.size(); i += 8) {
        std::uint64_t eight;
        std::memcpy(&eight, &flags[i], sizeof eight);
        if (eight == 0) continue;
        for (std::size_t k = i; k < i + 8; ++k) {
            if (flags[k] != 0) indices.push_back(static_cast<std::uint32_t>(k));
        }
    }
    for (; i < flags.size(); ++i) {
        if (flags[i] != 0) indices.push_back(static_cast<std::uint32_t>(i));
    }
    return indices;
}

}  // namespace

PoseMemory::PoseMemory(std::span<const vec3> positions)
    : positions_(positions.begin(), positions.end()),
      moved_((positions.size() + kMotionBlock - 1) / kMotionBlock) {}

std::uint32_t PoseMemory::advance(std::span<const vec3> positions) {
    assert(positions.size() == positions_.size());
    // Whether `count` vertices from `begin` on have not moved; cuts `count` at the last vertex.
    const auto same = [&](std::size_t begin, std::size_t& count) {
        count = std::min(count, positions.size() - begin);
        return std::memcmp(&positions_[begin], &positions[begin], count * sizeof(vec3)) == 0;
    };
    const auto take_over = [&](std::uint32_t block) -> std::uint32_t {
        const std::size_t begin = std::size_t{block} * kMotionBlock;
        std::size_t count = kMotionBlock;
        moved_[block] = same(begin, count) ? 0 : 1;
        if (moved_[block] != 0)
            std::memcpy(&positions_[begin], &positions[begin], count * sizeof(vec3));
        return moved_[block];
    };
    const auto take_over_stretch = [&](std::uint32_t first, std::uint32_t end) {
        std::size_t vertices = std::size_t{end - first} * kMotionBlock;
        std::uint32_t count = 0;
        if (same(std::size_t{first} * kMotionBlock, vertices)) {
            std::fill(moved_.begin() + first, moved_.begin() + end, std::uint8_t{0});
        } else {
            for (std::uint32_t block = first; block < end; ++block) count += take_over(block);
        }
        return count;
    };
    using Range = tbb::blocked_range<std::uint32_t>;
    return tbb::parallel_reduce(
        Range(0, block_count(), kGrain), std::uint32_t{0},
        [&](const Range& range, std::uint32_t count) {
            for (std::uint32_t block = range.begin(); block < range.end(); block += kStretch)
                count += take_over_stretch(block, std::min(block + kStretch, range.end()));
            return count;
        },
        std::plus<>());
}

std::vector<std::uint32_t> PoseMemory::moved_blocks() const { return indices_of(moved_); }

BlockLeaves::BlockLeaves(const Bvh& bvh, std::uint32_t block_count) : begin_(block_count + 1) {
    const auto leaf_count = static_cast<std::uint32_t>(bvh.leaf_parents.size());
    std::vector<std::uint32_t> last_leaf(block_count, leaf_count);
    for (std::uint32_t leaf = 0; leaf < leaf_count; ++leaf)
        for_each_block(bvh, leaf, last_leaf, [&](std::uint32_t block) { ++begin_[block + 1]; });
    for (std::uint32_t block = 0; block < block_count; ++block) begin_[block + 1] += begin_[block];
    leaves_.resize(begin_.back());
    std::vector<std::uint32_t> next(begin_.begin(), begin_.end() - 1);
    std::fill(last_leaf.begin(), last_leaf.end(), leaf_count);
    for (std::uint32_t leaf = 0; leaf < leaf_count; ++leaf) {
        for_each_block(bvh, leaf, last_leaf,
                       [&](std::uint32_t block) { leaves_[next[block]++] = leaf; });
    }
}

MovedParts BlockLeaves::reached(const Bvh& bvh, const PoseMemory& pose) const {
    assert(pose.block_count() + 1 == begin_.size());
    std::vector<std::uint8_t> leaf_moved(bvh.leaf_parents.size());
    for (const std::uint32_t block : pose.moved_blocks()) {
        for (std::uint32_t i = begin_[block]; i < begin_[block + 1]; ++i)
            leaf_moved[leaves_[i]] = 1;
    }
    MovedParts parts;
    parts.leaves = indices_of(leaf_moved);
    std::vector<std::uint8_t> node_moved(bvh.node_parents.size());
    for (const std::uint32_t leaf : parts.leaves) node_moved[bvh.leaf_parents[leaf] / kWidth] = 1;
    // Parents come before their children.
    for (std::size_t node = node_moved.size(); node-- > 1;) {
        if (node_moved[node] != 0) node_moved[bvh.node_parents[node] / kWidth] = 1;
    }
    parts.nodes = indices_of(node_moved);
    return parts;
}

}  // namespace mray
