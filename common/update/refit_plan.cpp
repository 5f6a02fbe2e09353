#include "common/update/refit_plan.h"

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
// Blocks that are compared at once, 6 KiB: 0.6 of the time if none of them has moved.
constexpr std::uint32_t kStretch = 32;
// A refit of parts pays up to this part of all: its order of visits is bad for caches.
constexpr double kWorthwhile = 0.6;

bool is_worthwhile(std::size_t parts, std::size_t all) {
    return static_cast<double>(parts) <= kWorthwhile * static_cast<double>(all);
}

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

/// The indices of flags that are not 0, ascending.
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

std::uint32_t PoseMemory::advance(std::span<const vec3> positions,
                                  std::span<const IndexRange> changed) {
    assert(positions.size() == positions_.size());
    std::uint32_t moved = 0;
    std::uint32_t end = 0;
    for (const IndexRange& range : changed) {
        // Neighbouring ranges may share a block.
        const std::uint32_t begin = std::max(end, range.begin / kMotionBlock);
        std::fill(moved_.begin() + end, moved_.begin() + std::min(begin, block_count()),
                  std::uint8_t{0});
        if (begin >= block_count()) return moved;
        end = range.end / kMotionBlock + (range.end % kMotionBlock != 0 ? 1 : 0);
        end = std::clamp(end, begin, block_count());
        moved += take_over(positions, {begin, end});
    }
    std::fill(moved_.begin() + end, moved_.end(), std::uint8_t{0});
    return moved;
}

/// Compares these blocks with the last pose, and takes those that moved.
std::uint32_t PoseMemory::take_over(std::span<const vec3> positions, IndexRange blocks) {
    // Whether `count` vertices from `begin` on have not moved; cuts `count` at the last vertex.
    const auto same = [&](std::size_t begin, std::size_t& count) {
        count = std::min(count, positions.size() - begin);
        return std::memcmp(&positions_[begin], &positions[begin], count * sizeof(vec3)) == 0;
    };
    const auto take_block = [&](std::uint32_t block) -> std::uint32_t {
        const std::size_t begin = std::size_t{block} * kMotionBlock;
        std::size_t count = kMotionBlock;
        moved_[block] = same(begin, count) ? 0 : 1;
        if (moved_[block] != 0)
            std::memcpy(&positions_[begin], &positions[begin], count * sizeof(vec3));
        return moved_[block];
    };
    const auto take_stretch = [&](std::uint32_t first, std::uint32_t end) {
        std::size_t vertices = std::size_t{end - first} * kMotionBlock;
        std::uint32_t count = 0;
        if (same(std::size_t{first} * kMotionBlock, vertices)) {
            std::fill(moved_.begin() + first, moved_.begin() + end, std::uint8_t{0});
        } else {
            for (std::uint32_t block = first; block < end; ++block) count += take_block(block);
        }
        return count;
    };
    using Range = tbb::blocked_range<std::uint32_t>;
    return tbb::parallel_reduce(
        Range(blocks.begin, blocks.end, kGrain), std::uint32_t{0},
        [&](const Range& range, std::uint32_t count) {
            for (std::uint32_t block = range.begin(); block < range.end(); block += kStretch)
                count += take_stretch(block, std::min(block + kStretch, range.end()));
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

RefitPlan RefitPlanner::plan(const Bvh& tree, RefitExtent extent) {
    const std::size_t leaf_count = tree.leaf_parents.size();
    RefitPlan all = {.all = true, .leaf_count = leaf_count};
    if (extent == RefitExtent::kAll) return all;
    if (moved_blocks_ == 0) return {};
    if (!is_worthwhile(moved_blocks_, pose_.block_count())) return all;
    if (!block_leaves_) block_leaves_.emplace(tree, pose_.block_count());
    RefitPlan plan;
    plan.parts = block_leaves_->reached(tree, pose_);
    plan.leaf_count = plan.parts.leaves.size();
    return is_worthwhile(plan.leaf_count, leaf_count) ? plan : all;
}

std::vector<IndexRange> covering_ranges(std::span<const std::uint32_t> indices, std::size_t most) {
    std::vector<std::uint32_t> gaps;
    for (std::size_t i = 1; i < indices.size(); ++i) {
        if (indices[i] - indices[i - 1] > 1) gaps.push_back(indices[i] - indices[i - 1]);
    }
    // Gaps of this size and more separate ranges; too many of one size are all filled.
    std::uint32_t parting = 2;
    if (gaps.size() >= most) {
        const auto place = gaps.end() - static_cast<std::ptrdiff_t>(most);
        std::nth_element(gaps.begin(), place, gaps.end());
        parting = *place + 1;
    }
    std::vector<IndexRange> ranges;
    for (const std::uint32_t index : indices) {
        if (ranges.empty() || index - (ranges.back().end - 1) >= parting)
            ranges.push_back({index, index});
        ranges.back().end = index + 1;
    }
    return ranges;
}

}  // namespace mray
