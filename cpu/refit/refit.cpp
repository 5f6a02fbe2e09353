#include "cpu/refit/refit.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "cpu/refit/refit.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "cpu/refit/refit_kernels-inl.h"

#if HWY_ONCE

#include "common/simd/simd_dispatch-inl.h"

namespace mray::cpu {
namespace {

HWY_EXPORT(refit_leaves);
HWY_EXPORT(refit_nodes);

// Elements a task: large enough to hide the scheduling, small enough to balance. The calling thread
// refits fewer by itself.
constexpr std::uint32_t kLeafGrain = 1024;
constexpr std::uint32_t kNodeGrain = 512;

/// Calls step(begin, end) for parts of [0, count).
template <class Step>
void for_each_part(std::uint32_t count, std::uint32_t grain, Step step) {
    if (count <= grain) return step(0, count);
    using Range = tbb::blocked_range<std::uint32_t>;
    tbb::parallel_for(Range(0, count, grain),
                      [&](const Range& range) { step(range.begin(), range.end()); });
}

void refit_all(const RefitArrays& tree, const IndexSequence& leaves,
               std::span<const vec3> positions, const SimdTarget& target) {
    const auto refit_leaves = SIMD_FUNCTION(refit_leaves, target);
    for_each_part(leaves.count, kLeafGrain, [=, &tree](std::uint32_t begin, std::uint32_t end) {
        refit_leaves(tree, leaves, begin, end, positions);
    });
}

/// Refits nodes of one level.
void refit_level(const RefitArrays& tree, const IndexSequence& nodes, const SimdTarget& target) {
    const auto refit_nodes = SIMD_FUNCTION(refit_nodes, target);
    for_each_part(nodes.count, kNodeGrain, [=, &tree](std::uint32_t begin, std::uint32_t end) {
        refit_nodes(tree, nodes, begin, end);
    });
}

}  // namespace

void refit(Bvh& bvh, std::span<const vec3> positions, const SimdTarget& target) {
    const RefitArrays tree(bvh);
    refit_all(tree, {nullptr, 0, static_cast<std::uint32_t>(bvh.leaves.size())}, positions, target);
    for (std::uint32_t level = bvh.depth(); level-- > 1;) {
        const std::uint32_t begin = bvh.level_begin[level];
        refit_level(tree, {nullptr, begin, bvh.level_begin[level + 1] - begin}, target);
    }
}

void refit(Bvh& bvh, std::span<const vec3> positions, const MovedParts& parts,
           const SimdTarget& target) {
    const RefitArrays tree(bvh);
    refit_all(tree, {parts.leaves.data(), 0, static_cast<std::uint32_t>(parts.leaves.size())},
              positions, target);
    const std::vector<std::uint32_t>& nodes = parts.nodes;
    const auto place_of = [&](std::uint32_t node) {
        return static_cast<std::uint32_t>(std::lower_bound(nodes.begin(), nodes.end(), node) -
                                          nodes.begin());
    };
    for (std::uint32_t level = bvh.depth(); level-- > 1;) {
        const std::uint32_t begin = place_of(bvh.level_begin[level]);
        const std::uint32_t end = place_of(bvh.level_begin[level + 1]);
        refit_level(tree, {nodes.data() + begin, 0, end - begin}, target);
    }
}

}  // namespace mray::cpu

#endif  // HWY_ONCE
