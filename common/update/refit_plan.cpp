#include "common/update/refit_plan.h"

#include <algorithm>
#include <cassert>

namespace mray {
namespace {

// A refit of parts pays up to this part of all: its order of visits is bad for caches.
constexpr double kWorthwhile = 0.6;

bool is_worthwhile(std::size_t parts, std::size_t all) {
    return static_cast<double>(parts) <= kWorthwhile * static_cast<double>(all);
}

/// Calls `use(block)` once for each block of a leaf's vertices.
template <class Use>
void for_each_block(const Bvh& bvh, std::uint32_t leaf, std::vector<std::uint32_t>& last_leaf,
                    Use use) {
    for (const std::uint32_t vertex : vertices_of(bvh.leaf_vertices, leaf)) {
        const std::uint32_t block = vertex / kMotionBlock;
        if (last_leaf[block] == leaf) continue;
        last_leaf[block] = leaf;
        use(block);
    }
}

}  // namespace

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

MovedParts BlockLeaves::reached(const Bvh& bvh, const Pose& pose) const {
    assert(pose.block_count() + 1 == begin_.size());
    std::vector<std::uint8_t> leaf_moved(bvh.leaf_parents.size());
    for (const std::uint32_t block : pose.moved_blocks()) {
        for (std::uint32_t i = begin_[block]; i < begin_[block + 1]; ++i)
            leaf_moved[leaves_[i]] = 1;
    }
    MovedParts parts;
    parts.leaves = indices_of(leaf_moved);
    std::vector<std::uint8_t> node_moved(bvh.node_parents.size());
    for (const std::uint32_t leaf : parts.leaves)
        node_moved[parent_node(bvh.leaf_parents[leaf])] = 1;
    // Parents come before their children.
    for (std::size_t node = node_moved.size(); node-- > 1;) {
        if (node_moved[node] != 0) node_moved[parent_node(bvh.node_parents[node])] = 1;
    }
    parts.nodes = indices_of(node_moved);
    return parts;
}

RefitPlan plan_refit(const Bvh& tree, const Pose& pose, RefitExtent extent,
                     std::optional<BlockLeaves>& block_leaves) {
    const std::size_t leaf_count = tree.leaf_parents.size();
    RefitPlan all = {.all = true, .leaf_count = leaf_count};
    if (extent == RefitExtent::kAll) return all;
    const std::uint32_t moved = pose.moved_count();
    if (moved == 0) return {};
    if (!is_worthwhile(moved, pose.block_count())) return all;
    if (!block_leaves) block_leaves.emplace(tree, pose.block_count());
    RefitPlan plan;
    plan.parts = block_leaves->reached(tree, pose);
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
