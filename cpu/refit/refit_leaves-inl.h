// The leaves of a refit, compiled once for each target.
//
// A register takes 2 or 4 vertices, gathered by whole loads of 16 bytes, so a leaf of 16 is 8 or 4
// of each operation. Registers of one vertex are those of refit_leaf.
#if defined(MORPHRAY_CPU_REFIT_REFIT_LEAVES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_REFIT_REFIT_LEAVES_INL_H
#undef MORPHRAY_CPU_REFIT_REFIT_LEAVES_INL_H
#else
#define MORPHRAY_CPU_REFIT_REFIT_LEAVES_INL_H
#endif

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include "common/bvh/bvh_refit.h"
#include "common/simd/vectors-inl.h"
#include "cpu/refit/leaf_sequence.h"

HWY_BEFORE_NAMESPACE();
namespace morphray::cpu {
namespace HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

// Leaves are asked for so many before they are needed, with all that their refit reads and writes
// (docs/layout.md, "Building and refitting").
inline constexpr std::uint32_t kLeavesAhead = 16;

HWY_INLINE void prefetch_leaf(const RefitArrays& tree, std::uint32_t index,
                              std::span<const vec3> positions) {
    constexpr std::size_t kCacheLine = 64;
    const auto* const bytes = reinterpret_cast<const std::byte*>(&tree.leaves[index].vertex);
    for (std::size_t at = 0; at < sizeof(Leaf::vertex); at += kCacheLine)
        __builtin_prefetch(bytes + at, 1);
    const std::uint32_t* source = &tree.leaf_vertices[std::size_t{index} * kLeafVertices];
    for (std::uint32_t slot = 0; slot < kLeafVertices; ++slot)
        __builtin_prefetch(&positions[source[slot]]);
}

#if HWY_TARGET == HWY_SCALAR

HWY_INLINE void refit_wide_leaf(const RefitArrays& tree, std::uint32_t index,
                                std::span<const vec3> positions) {
    refit_leaf(tree, index, positions);
}

#else

/// As many vertices as a register holds, each with what follows it in memory.
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

template <class Tag, class Reduce>
HWY_INLINE float4 reduce_vertices(Tag tag, hn::Vec<Tag> v, Reduce reduce) {
    if constexpr (hn::MaxLanes(tag) == 4) {
        alignas(16) float4 result;
        hn::Store(v, tag, reinterpret_cast<float*>(&result));
        return result;
    } else {
        const hn::Half<Tag> half;
        return reduce_vertices(half, reduce(hn::LowerHalf(half, v), hn::UpperHalf(half, v)),
                               reduce);
    }
}

HWY_INLINE bool has_vertex(const std::uint32_t* source, std::uint32_t vertex) {
    const UintVec wanted = splat(vertex);
    UintMask found = load_unaligned(source) == wanted;
    for (std::uint32_t slot = kLanes; slot < kLeafVertices; slot += kLanes)
        found = found | (load_unaligned(source + slot) == wanted);
    return !none(found);
}

/// refit_leaf in registers of several vertices.
HWY_INLINE void refit_wide_leaf(const RefitArrays& tree, std::uint32_t index,
                                std::span<const vec3> positions) {
    if constexpr (kLanes == 4) return refit_leaf(tree, index, positions);
    const std::uint32_t* source = &tree.leaf_vertices[std::size_t{index} * kLeafVertices];
    // Nothing may follow the last vertex in memory.
    if (has_vertex(source, static_cast<std::uint32_t>(positions.size()) - 1)) [[unlikely]]
        return refit_leaf(tree, index, positions);
    const auto is_corners = float_mask((hn::Iota(kUints, 0u) & splat(3u)) == splat(3u));
    Leaf& leaf = tree.leaves[index];
    FloatVec lower = splat(kEmptyPlane);
    FloatVec upper = splat(-kEmptyPlane);
    for (std::uint32_t slot = 0; slot < kLeafVertices; slot += kLanes / 4) {
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
    const Box box = Box4{
        reduce_vertices(kFloats, lower, [](auto a, auto b) { return hn::Min(a, b); }),
        reduce_vertices(kFloats, upper, [](auto a, auto b) {
            return hn::Max(a, b);
        })}.box();
    if (!is_finite_vertex(box.upper)) [[unlikely]]
        return refit_leaf(tree, index, positions);
    const std::uint32_t parent = tree.leaf_parents[index];
    set_slot_box(tree.nodes[parent / kWidth], parent % kWidth, box);
}

#endif  // HWY_TARGET

/// Refits leaves[begin .. end).
void refit_leaves(const RefitArrays& tree, const LeafSequence& leaves, std::uint32_t begin,
                  std::uint32_t end, std::span<const vec3> positions) {
    // Copies, which stay in registers.
    const RefitArrays own = tree;
    const LeafSequence all = leaves;
    for (std::uint32_t i = begin; i < end; ++i) {
        prefetch_leaf(own, all[std::min(i + kLeavesAhead, all.count - 1)], positions);
        refit_wide_leaf(own, all[i], positions);
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace morphray::cpu
HWY_AFTER_NAMESPACE();

#endif  // per target
