#include "cpu/refit/refit.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "cpu/refit/refit.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "cpu/simd/node-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu::HWY_NAMESPACE {

// The number of leaves by which prefetches run ahead, with all that a leaf's refit reads and writes
// (lab/notes/build_and_refit.md).
inline constexpr std::uint32_t kLeavesAhead = 16;

HWY_INLINE void prefetch_leaf(const RefitArrays& tree, std::uint32_t index,
                              std::span<const vec3> positions) {
    const auto* const bytes = reinterpret_cast<const std::byte*>(&tree.leaves[index].vertex);
    for (std::size_t at = 0; at < sizeof(Leaf::vertex); at += kCacheLine)
        __builtin_prefetch(bytes + at, 1);
    for (const std::uint32_t vertex : vertices_of(tree.leaf_vertices, index))
        __builtin_prefetch(&positions[vertex]);
}

#if HWY_TARGET == HWY_SCALAR

HWY_INLINE void refit_leaf_in_lanes(const RefitArrays& tree, std::uint32_t index,
                                    std::span<const vec3> positions) {
    refit_leaf(tree, index, positions);
}

HWY_INLINE void refit_node_in_lanes(const RefitArrays& tree, std::uint32_t index) {
    refit_node(tree, index);
}

#else

/// As many vertices as a register holds, each with the four bytes that follow it in memory.
template <class Tag>
HWY_INLINE hn::Vec<Tag> gather_vertices(Tag tag, const vec3* positions,
                                        const std::uint32_t* source) {
    if constexpr (hn::MaxLanes(tag) == 4) {
        return hn::LoadU(tag, &positions[*source].x);
    } else {
        const hn::Half<Tag> half;
        return hn::Combine(tag, gather_vertices(half, positions, source + hn::MaxLanes(half) / 4),
                           gather_vertices(half, positions, source));
    }
}

HWY_INLINE bool has_vertex(const std::uint32_t* source, std::uint32_t vertex) {
    const UintVec wanted = splat(vertex);
    UintMask found = load_unaligned(source) == wanted;
    for (std::uint32_t slot = kLanes; slot < kMaxLanes; slot += kLanes)
        found = found | (load_unaligned(source + slot) == wanted);
    return !none(found);
}

/// largest_extent() of the bounds in the first three lanes, in all lanes.
HWY_INLINE Float4 largest_extents(Float4 lower, Float4 upper) {
    const auto is_axis = hn::FirstN(kFloats4, 3);
    const Float4 extent = hn::IfThenElseZero(is_axis, upper - lower);
    const Float4 pairs = max(extent, hn::Shuffle2301(extent));
    return max(pairs, hn::Shuffle1032(pairs));
}

HWY_INLINE Float4 plane_pads(Float4 planes, Float4 extent) {
    return splat4(kPadOfExtent) * extent + splat4(kPadOfPlane) * hn::Abs(planes);
}

/// Gives a slot the padded box of bounds in three lanes a block. False: a vertex is not finite.
HWY_INLINE bool set_finite_slot(Node* nodes, std::uint32_t parent, FloatVec lower, FloatVec upper) {
    const Float4 least =
        reduce_blocks(kFloats, lower, [](auto a, auto b) HWY_ATTR { return hn::Min(a, b); });
    const Float4 most =
        reduce_blocks(kFloats, upper, [](auto a, auto b) HWY_ATTR { return hn::Max(a, b); });
    if (!(hn::GetLane(most) <= kSceneExtent)) [[unlikely]]
        return false;
    const Float4 extent = largest_extents(least, most);
    alignas(16) float l[4], u[4];
    store(least - plane_pads(least, extent), l);
    store(most + plane_pads(most, extent), u);
    set_parent_box(nodes, parent, {{l[0], l[1], l[2]}, {u[0], u[1], u[2]}});
    return true;
}

/// A call, so that the loop keeps its registers.
HWY_NOINLINE void refit_rare_leaf(const RefitArrays& tree, std::uint32_t index,
                                  std::span<const vec3> positions) {
    refit_leaf(tree, index, positions);
}

/// refit_leaf with kLanes / 4 vertices a register: a leaf is 16, 8 or 4 of each operation.
HWY_INLINE void refit_leaf_in_lanes(const RefitArrays& tree, std::uint32_t index,
                                    std::span<const vec3> positions) {
    const std::uint32_t* source = vertices_of(tree.leaf_vertices, index).data();
    // Nothing may follow the last vertex in memory.
    if (has_vertex(source, static_cast<std::uint32_t>(positions.size()) - 1)) [[unlikely]]
        return refit_rare_leaf(tree, index, positions);
    const Mask is_corners = float_mask((hn::Iota(kUints, 0u) & splat(3u)) == splat(3u));
    Leaf& leaf = tree.leaves[index];
    FloatVec lower = splat(kEmptyPlane);
    FloatVec upper = splat(-kEmptyPlane);
    for (std::uint32_t slot = 0; slot < std::size(leaf.vertex); slot += kLanes / 4) {
        const FloatVec p = gather_vertices(kFloats, positions.data(), source + slot);
        lower = min(lower, p);
        upper = max(upper, p);
        float* const to = &leaf.vertex[slot].x;
        if constexpr (kLanes == 16) {
            hn::BlendedStore(p, !is_corners, kFloats, to);
        } else {
            store_unaligned(select(is_corners, load_unaligned(to), p), to);
        }
    }
    if (!set_finite_slot(tree.nodes, tree.leaf_parents[index], lower, upper)) [[unlikely]]
        refit_rare_leaf(tree, index, positions);
}

/// `combine` (min or max) of each of a node's planes x, y and z of a side, in the first three
/// lanes.
template <class Combine>
HWY_INLINE Float4 combine_planes(const Node& node, std::uint32_t side, Combine combine) {
    Float4 v[3];
    for (std::uint32_t axis = 0; axis < 3; ++axis) {
        v[axis] = four_planes(node, axis, side, 0);
        for (std::uint32_t quarter = 1; quarter < kQuarters; ++quarter)
            v[axis] = combine(v[axis], four_planes(node, axis, side, quarter));
    }
    const auto pair = [&](Float4 a, Float4 b) HWY_ATTR {
        return combine(hn::InterleaveLower(kFloats4, a, b), hn::InterleaveUpper(kFloats4, a, b));
    };
    const Float4 xy = pair(v[0], v[1]);
    const Float4 zz = pair(v[2], v[2]);
    return combine(hn::ConcatLowerLower(kFloats4, zz, xy), hn::ConcatUpperUpper(kFloats4, zz, xy));
}

HWY_INLINE void refit_node_in_lanes(const RefitArrays& tree, std::uint32_t index) {
    const std::uint32_t parent = tree.node_parents[index];
    if (parent == kNoParent) return;
    const Node& node = tree.nodes[index];
    alignas(16) float lower[4], upper[4];
    store(combine_planes(node, 0, [](Float4 a, Float4 b) HWY_ATTR { return min(a, b); }), lower);
    store(combine_planes(node, 1, [](Float4 a, Float4 b) HWY_ATTR { return max(a, b); }), upper);
    set_parent_box(tree.nodes, parent,
                   {{lower[0], lower[1], lower[2]}, {upper[0], upper[1], upper[2]}});
}

#endif  // HWY_TARGET

void refit_leaves(const RefitArrays& tree, const IndexSequence& leaves, std::uint32_t begin,
                  std::uint32_t end, std::span<const vec3> positions) {
    // Copies, which stay in registers.
    const RefitArrays own = tree;
    const IndexSequence all = leaves;
    for (std::uint32_t i = begin; i < end; ++i) {
        prefetch_leaf(own, all[std::min(i + kLeavesAhead, all.count - 1)], positions);
        refit_leaf_in_lanes(own, all[i], positions);
    }
}

void refit_nodes(const RefitArrays& tree, const IndexSequence& nodes, std::uint32_t begin,
                 std::uint32_t end) {
    const RefitArrays own = tree;
    const IndexSequence all = nodes;
    for (std::uint32_t i = begin; i < end; ++i) refit_node_in_lanes(own, all[i]);
}

}  // namespace mray::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

#include "common/simd/simd_dispatch-inl.h"

namespace mray::cpu {

HWY_EXPORT(refit_leaves);
HWY_EXPORT(refit_nodes);

namespace {

// Elements a task, to hide scheduling and to balance. The calling thread refits fewer alone.
constexpr std::uint32_t kLeafGrain = 1024;
constexpr std::uint32_t kNodeGrain = 512;

template <class Visit>
void for_each_range(std::uint32_t count, std::uint32_t grain, Visit visit) {
    if (count <= grain) return visit(0, count);
    using Range = tbb::blocked_range<std::uint32_t>;
    tbb::parallel_for(Range(0, count, grain),
                      [&](const Range& range) { visit(range.begin(), range.end()); });
}

}  // namespace

void refit(Bvh& bvh, std::span<const vec3> positions, const SimdTarget& target,
           const MovedParts* parts) {
    const RefitArrays tree(bvh);
    const auto refit_leaves = SIMD_FUNCTION(refit_leaves, target);
    const auto refit_nodes = SIMD_FUNCTION(refit_nodes, target);
    IndexSequence leaves = {nullptr, 0, static_cast<std::uint32_t>(bvh.leaves.size())};
    if (parts != nullptr)
        leaves = {parts->leaves.data(), 0, static_cast<std::uint32_t>(parts->leaves.size())};
    for_each_range(leaves.count, kLeafGrain, [&](std::uint32_t begin, std::uint32_t end) {
        refit_leaves(tree, leaves, begin, end, positions);
    });
    const auto place_of = [&](std::uint32_t node) {
        if (parts == nullptr) return node;
        const auto first = parts->nodes.begin();
        return static_cast<std::uint32_t>(std::lower_bound(first, parts->nodes.end(), node) -
                                          first);
    };
    for (std::uint32_t level = bvh.depth(); level-- > 1;) {
        const std::uint32_t first = place_of(bvh.level_begin[level]);
        const IndexSequence nodes = {parts == nullptr ? nullptr : parts->nodes.data(), first,
                                     place_of(bvh.level_begin[level + 1]) - first};
        for_each_range(nodes.count, kNodeGrain, [&](std::uint32_t begin, std::uint32_t end) {
            refit_nodes(tree, nodes, begin, end);
        });
    }
}

}  // namespace mray::cpu

#endif  // HWY_ONCE
