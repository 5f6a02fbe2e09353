#include "cpu/refit.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>

#include "common/bvh_refit.h"

namespace morphray::cpu {
namespace {

// Elements a task: large enough to hide the scheduling, small enough to balance. Fewer nodes are
// one thread's.
constexpr std::uint32_t kLeafGrain = 1024;
constexpr std::uint32_t kNodeGrain = 512;

// Positions of more vertices than this do not fit a core's second cache (12 bytes each), and are
// asked for kLeavesAhead leaves before they are needed. One thread, ns a triangle: 1M triangles in
// no order 3.5 without, 2.6 with 4 leaves ahead, 2.2 with 8, 1.9 with 16; 60,000 triangles (31,000
// vertices) 1.07 without, 1.26 with.
constexpr std::size_t kCachedVertices = 65536;
constexpr std::uint32_t kLeavesAhead = 16;

void prefetch_positions(const RefitArrays& tree, std::uint32_t leaf,
                        std::span<const vec3> positions) {
    const std::uint32_t* source = &tree.leaf_vertices[std::size_t{leaf} * kLeafVertices];
    for (std::uint32_t slot = 0; slot < kLeafVertices; ++slot)
        __builtin_prefetch(&positions[source[slot]]);
}

/// Calls step(first, last) for parts of a range of indices.
template <class Step>
void for_each_part(std::uint32_t begin, std::uint32_t end, std::uint32_t grain, Step step) {
    if (end - begin <= grain) return step(begin, end);
    using Range = tbb::blocked_range<std::uint32_t>;
    tbb::parallel_for(Range(begin, end, grain),
                      [&](const Range& range) { step(range.begin(), range.end()); });
}

/// Refits the leaves leaf_at(0 .. count).
template <class LeafAt>
void refit_leaves(const RefitArrays& tree, std::uint32_t count, LeafAt leaf_at,
                  std::span<const vec3> positions) {
    const bool is_cached = positions.size() <= kCachedVertices;
    for_each_part(0, count, kLeafGrain, [=](std::uint32_t begin, std::uint32_t end) {
        const RefitArrays own = tree;
        for (std::uint32_t i = begin; i < end; ++i) {
            if (!is_cached)
                prefetch_positions(own, leaf_at(std::min(i + kLeavesAhead, count - 1)), positions);
            refit_leaf(own, leaf_at(i), positions);
        }
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

void refit(Bvh& bvh, std::span<const vec3> positions) {
    const RefitArrays tree(bvh);
    const auto itself = [](std::uint32_t index) { return index; };
    refit_leaves(tree, static_cast<std::uint32_t>(bvh.leaves.size()), itself, positions);
    for (std::uint32_t level = bvh.depth(); level-- > 1;)
        refit_level(tree, bvh.level_begin[level], bvh.level_begin[level + 1], itself);
}

void refit(Bvh& bvh, std::span<const vec3> positions, const MovedParts& parts) {
    const RefitArrays tree(bvh);
    refit_leaves(
        tree, static_cast<std::uint32_t>(parts.leaves.size()),
        [leaves = parts.leaves.data()](std::uint32_t i) { return leaves[i]; }, positions);
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
