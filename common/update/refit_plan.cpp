#include "common/update/refit_plan.h"

#include <algorithm>

namespace mray {
namespace {

// A refit of parts pays up to this part of all leaves or blocks, since its order of visits is bad
// for caches.
constexpr double kWorthwhile = 0.6;

bool is_worthwhile(std::size_t parts, std::size_t all) {
    return static_cast<double>(parts) <= kWorthwhile * static_cast<double>(all);
}

}  // namespace

void RefitPlanner::set_frame(std::span<const vec3> positions) {
    pose_.advance(positions);
    block_leaves_.reset();
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
    // Gaps of this size and more separate ranges. If too many gaps have the same size, all of them
    // are filled.
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
