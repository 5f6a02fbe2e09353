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
HWY_EXPORT(split_few);

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
    const Binning binning(bounds[0], kManyBins);
    AlignedVector<ManyBins> bins(chunk_count);
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
    return {left_before.back(), best.left_size};
}

/// Half the area of a box, 0 or more for an empty one.
float area_of(const float* planes) {
    const float x = -planes[4] - planes[0];
    const float y = -planes[5] - planes[1];
    const float z = -planes[6] - planes[2];
    return x * y + y * z + z * x;
}

/// Whether a and b have two vertices in common, and no third one.
bool share_an_edge(const uvec3& a, const uvec3& b) {
    const auto in_a = [&](std::uint32_t v) { return v == a.x || v == a.y || v == a.z ? 1 : 0; };
    return in_a(b.x) + in_a(b.y) + in_a(b.z) == 2;
}

// Of the sum of the areas of both boxes. That of two halves of a flat square lies between a half
// and 1; less would leave out more, and more makes trees up to 4 % worse
// (lab/notes/build_and_refit.md).
constexpr float kPairArea = 0.75f;

}  // namespace

void make_refs(const Topology& topology, std::span<const vec3> positions, std::uint32_t first,
               std::span<PrimRef> refs, const SimdTarget& target) {
    SIMD_FUNCTION(make_refs, target)(topology, positions, first, refs);
}

std::size_t pair_refs(const Topology& topology, std::span<PrimRef> refs) {
    std::size_t count = 0;
    for (std::size_t i = 0; i < refs.size(); ++i) {
        PrimRef ref = refs[i];
        if (i + 1 < refs.size() && share_an_edge(topology.triangles[ref.prim_id()],
                                                 topology.triangles[refs[i + 1].prim_id()])) {
            const PrimRef& next = refs[i + 1];
            PrimRef pair;
            for (int k = 0; k < 8; ++k) pair.planes[k] = std::min(ref.planes[k], next.planes[k]);
            // The lesser id is that of the first.
            pair.planes[7] = PrimRef::kPair;
            const float sum = area_of(ref.planes) + area_of(next.planes);
            if (area_of(pair.planes) <= kPairArea * sum) {
                ref = pair;
                ++i;
            }
        }
        refs[count++] = ref;
    }
    return count;
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

PartSize split_few(std::span<const PrimRef> refs, PrimRef* out, const SimdTarget& target) {
    return SIMD_FUNCTION(split_few, target)(refs, out);
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
