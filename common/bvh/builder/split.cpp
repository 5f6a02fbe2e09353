#include "common/bvh/builder/split.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <vector>

#include "common/base/aligned_vector.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/bvh/builder/split.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "common/bvh/builder/split-inl.h"

#if HWY_ONCE

#include "common/simd/simd_dispatch-inl.h"

namespace mray {
namespace {

HWY_EXPORT(make_refs);
HWY_EXPORT(union_of);
HWY_EXPORT(bound_centroids);
HWY_EXPORT(split_at_once);
HWY_EXPORT(bin_chunk);
HWY_EXPORT(best_of_chunks);
HWY_EXPORT(count_left);
HWY_EXPORT(divide_chunk);

// Sets of two chunks or more are bounded, binned and divided by chunks, each a task.
constexpr std::size_t kChunk = 8192;

/// Boxes and counts do not depend on the order in which chunks are added, nor places on the thread
/// that writes them: so neither does the result on the number of threads.
PartSize split_in_chunks(std::span<const PrimRef> refs, PrimRef* out, const SimdTarget& target) {
    const std::size_t chunk_count = (refs.size() + kChunk - 1) / kChunk;
    const auto for_each_chunk = [&](auto step) {
        tbb::parallel_for(std::size_t{0}, chunk_count, [&](std::size_t i) {
            step(i, refs.subspan(i * kChunk, std::min(kChunk, refs.size() - i * kChunk)));
        });
    };
    std::vector<Box> bounds(chunk_count);
    for_each_chunk([&](std::size_t i, std::span<const PrimRef> chunk) {
        bounds[i] = centroid_bounds(chunk, target);
    });
    for (const Box& b : bounds) bounds[0].extend(b);
    const Binning binning(bounds[0]);
    AlignedVector<Bins> bins(chunk_count);
    for_each_chunk(
        [&, bin_chunk = SIMD_FUNCTION(bin_chunk, target)](
            std::size_t i, std::span<const PrimRef> chunk) { bin_chunk(chunk, binning, bins[i]); });
    const Split best = SIMD_FUNCTION(best_of_chunks, target)(bins);
    if (best.position == 0) return {};

    std::vector<std::size_t> left_before(chunk_count + 1, 0);
    for_each_chunk([&, count_left = SIMD_FUNCTION(count_left, target)](
                       std::size_t i, std::span<const PrimRef> chunk) {
        left_before[i + 1] = count_left(chunk, binning, best);
    });
    for (std::size_t i = 0; i < chunk_count; ++i) left_before[i + 1] += left_before[i];
    for_each_chunk([&, divide_chunk = SIMD_FUNCTION(divide_chunk, target)](
                       std::size_t i, std::span<const PrimRef> chunk) {
        divide_chunk(chunk, out, left_before[i], best.left_size + i * kChunk - left_before[i],
                     binning, best);
    });
    return {left_before.back(), best.left_size, best.cost};
}

}  // namespace

void make_refs(const Topology& topology, std::span<const vec3> positions, std::uint32_t first,
               std::span<PrimRef> refs, const SimdTarget& target) {
    SIMD_FUNCTION(make_refs, target)(topology, positions, first, refs);
}

Box union_of(std::span<const PrimRef> refs, const SimdTarget& target) {
    return SIMD_FUNCTION(union_of, target)(refs);
}

Box centroid_bounds(std::span<const PrimRef> refs, const SimdTarget& target) {
    return SIMD_FUNCTION(bound_centroids, target)(refs);
}

PartSize split_binned(std::span<const PrimRef> refs, PrimRef* out, const SimdTarget& target) {
    return refs.size() >= 2 * kChunk ? split_in_chunks(refs, out, target)
                                     : SIMD_FUNCTION(split_at_once, target)(refs, out);
}

PartSize split_median(std::span<const PrimRef> refs, PrimRef* out, const SimdTarget& target) {
    const Box bounds = centroid_bounds(refs, target);
    const vec3 extent = bounds.upper - bounds.lower;
    int widest = 0;
    for (int axis = 1; axis < 3; ++axis) {
        if (extent[axis] > extent[widest]) widest = axis;
    }
    // An order without ties.
    const auto before = [widest](const PrimRef& a, const PrimRef& b) {
        const float ca = a.centroid2(widest);
        const float cb = b.centroid2(widest);
        return ca < cb || (ca == cb && a.prim_id() < b.prim_id());
    };
    std::vector<PrimRef> order(refs.begin(), refs.end());
    const std::size_t left_size = refs.size() / 2;
    const auto pivot = order.begin() + static_cast<std::ptrdiff_t>(left_size);
    std::nth_element(order.begin(), pivot, order.end(), before);
    std::size_t left_triangles = 0;
    for (auto ref = order.begin(); ref != pivot; ++ref) left_triangles += ref->triangle_count();
    PrimRef* left = out;
    PrimRef* right = out + left_triangles;
    for (const PrimRef& ref : refs) *(before(ref, *pivot) ? left : right)++ = ref;
    return {left_size, left_triangles};
}

}  // namespace mray

#endif  // HWY_ONCE
