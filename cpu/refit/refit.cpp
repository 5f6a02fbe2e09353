#include "cpu/refit/refit.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "cpu/refit/refit.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "cpu/refit/refit_leaves-inl.h"

#if HWY_ONCE

#include "common/simd/simd_dispatch-inl.h"

namespace morphray::cpu {
namespace {

HWY_EXPORT(refit_leaves);

// Elements a task: large enough to hide the scheduling, small enough to balance. Fewer nodes are
// one thread's.
constexpr std::uint32_t kLeafGrain = 1024;
constexpr std::uint32_t kNodeGrain = 512;

/// Calls step(first, last) for parts of a range of indices.
template <class Step>
void for_each_part(std::uint32_t begin, std::uint32_t end, std::uint32_t grain, Step step) {
    if (end - begin <= grain) return step(begin, end);
    using Range = tbb::blocked_range<std::uint32_t>;
    tbb::parallel_for(Range(begin, end, grain),
                      [&](const Range& range) { step(range.begin(), range.end()); });
}

void refit_parts(const RefitArrays& tree, const LeafSequence& leaves,
                 std::span<const vec3> positions, const SimdTarget& target) {
    const auto refit_leaves = SIMD_FUNCTION(refit_leaves, target);
    for_each_part(0, leaves.count, kLeafGrain, [=, &tree](std::uint32_t begin, std::uint32_t end) {
        refit_leaves(tree, leaves, begin, end, positions);
    });
}

/// Refits the nodes node_at(begin .. end), of one level.
template <class NodeAt>
void refit_level(const RefitArrays& tree, std::uint32_t begin, std::uint32_t end, NodeAt node_at) {
    for_each_part(begin, end, kNodeGrain, [=](std::uint32_t first, std::uint32_t last) {
        const RefitArrays own = tree;
        for (std::uint32_t i = first; i < last; ++i) refit_node(own, node_at(i));
    });
}

}  // namespace

void refit(Bvh& bvh, std::span<const vec3> positions, const SimdTarget& target) {
    const RefitArrays tree(bvh);
    refit_parts(tree, {nullptr, static_cast<std::uint32_t>(bvh.leaves.size())}, positions, target);
    for (std::uint32_t level = bvh.depth(); level-- > 1;) {
        refit_level(tree, bvh.level_begin[level], bvh.level_begin[level + 1],
                    [](std::uint32_t index) { return index; });
    }
}

void refit(Bvh& bvh, std::span<const vec3> positions, const MovedParts& parts,
           const SimdTarget& target) {
    const RefitArrays tree(bvh);
    refit_parts(tree, {parts.leaves.data(), static_cast<std::uint32_t>(parts.leaves.size())},
                positions, target);
    const std::vector<std::uint32_t>& nodes = parts.nodes;
    const auto place_of = [&](std::uint32_t node) {
        return static_cast<std::uint32_t>(std::lower_bound(nodes.begin(), nodes.end(), node) -
                                          nodes.begin());
    };
    for (std::uint32_t level = bvh.depth(); level-- > 1;) {
        refit_level(tree, place_of(bvh.level_begin[level]), place_of(bvh.level_begin[level + 1]),
                    [list = nodes.data()](std::uint32_t i) { return list[i]; });
    }
}

}  // namespace morphray::cpu

#endif  // HWY_ONCE
