#include "common/bvh/builder/split.h"

#include <tbb/parallel_for.h>

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
HWY_EXPORT(choose_boundary);
HWY_EXPORT(count_left);
HWY_EXPORT(divide_chunk);

// So many refs of a larger set find its boundary: trees of 256 cost 1 % more, with 2,048 builds
// take 1.02 of the time (lab/notes/build_and_refit.md).
constexpr std::size_t kSample = 512;
// Refs of a task, whatever the number of threads.
constexpr std::size_t kChunk = 8192;

/// Places do not depend on the thread that writes them: so the result is that of any threads.
PartSize split_by_sample(std::span<const PrimRef> refs, PrimRef* out, const SimdTarget& target) {
    PrimRef sample[kSample];
    for (std::size_t i = 0; i < kSample; ++i) sample[i] = refs[i * refs.size() / kSample];
    const float refs_each = static_cast<float>(refs.size()) / kSample;
    Binning binning;
    const Split best = SIMD_FUNCTION(choose_boundary, target)(std::span<const PrimRef>(sample),
                                                              kPartCost / refs_each, binning);
    // Centroids of others than the sample may differ.
    if (best.position == 0) return SIMD_FUNCTION(split_at_once, target)(refs, out);

    const std::size_t chunk_count = (refs.size() + kChunk - 1) / kChunk;
    const auto for_each_chunk = [&](auto step) {
        tbb::parallel_for(std::size_t{0}, chunk_count, [&](std::size_t i) {
            step(i, refs.subspan(i * kChunk, std::min(kChunk, refs.size() - i * kChunk)));
        });
    };
    std::vector<PartSize> left_before(chunk_count + 1);
    for_each_chunk([&, count_left = SIMD_FUNCTION(count_left, target)](
                       std::size_t i, std::span<const PrimRef> chunk) {
        left_before[i + 1] = count_left(chunk, binning, best);
    });
    for (std::size_t i = 0; i < chunk_count; ++i) {
        left_before[i + 1].refs += left_before[i].refs;
        left_before[i + 1].triangles += left_before[i].triangles;
    }
    PartSize left = left_before.back();
    for_each_chunk([&, divide_chunk = SIMD_FUNCTION(divide_chunk, target)](
                       std::size_t i, std::span<const PrimRef> chunk) {
        const std::size_t before = left_before[i].refs;
        divide_chunk(chunk, out, before, left.triangles + i * kChunk - before, binning, best);
    });
    left.cost = best.cost * refs_each;
    return left;
}

// One an octave: the largest boxes are in the first, all below 2^-15 of their area in the last.
constexpr std::uint32_t kAreaBins = 16;

/// Ascends with the area.
std::uint32_t key_of(float area) { return std::bit_cast<std::uint32_t>(area) >> 23; }

/// The refs of some bins.
struct RefSum {
    Box box;
    std::size_t refs = 0;
    std::size_t triangles = 0;

    void add(const RefSum& other) {
        box.extend(other.box);
        refs += other.refs;
        triangles += other.triangles;
    }
    float cost() const {
        return PrimRef(box, 0).area() * (static_cast<float>(triangles) + kPartCost);
    }
};

// Where no box has more than this part of the mean area of the two parts, a plane divides well.
constexpr float kLargeArea = 0.25f;

/// True if exactly two vertices of b are vertices of a.
bool share_an_edge(const uvec3& a, const uvec3& b) {
    const auto in_a = [&](std::uint32_t v) { return v == a.x || v == a.y || v == a.z ? 1 : 0; };
    return in_a(b.x) + in_a(b.y) + in_a(b.z) == 2;
}

// The largest area of a pair's box, as a part of the sum of the areas of both boxes. A smaller part
// makes fewer pairs, a larger one trees that cost up to 4 % more (lab/notes/build_and_refit.md).
constexpr float kPairArea = 0.75f;
// Triangles of a task, whatever the number of threads.
constexpr std::size_t kPairingTask = 2048;

}  // namespace

void make_refs(const Topology& topology, std::span<const vec3> positions, std::uint32_t first,
               std::span<PrimRef> refs, const SimdTarget& target) {
    SIMD_FUNCTION(make_refs, target)(topology, positions, first, refs);
}

Box union_of(std::span<const PrimRef> refs, const SimdTarget& target) {
    return SIMD_FUNCTION(union_of, target)(refs);
}

PartSize split_binned(std::span<const PrimRef> refs, PrimRef* out, const SimdTarget& target) {
    return refs.size() >= 2 * kSample ? split_by_sample(refs, out, target)
                                      : SIMD_FUNCTION(split_at_once, target)(refs, out);
}

PartSize split_median(std::span<const PrimRef> refs, PrimRef* out, const SimdTarget& target) {
    const Box bounds = SIMD_FUNCTION(bound_centroids, target)(refs);
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

float largest_area(std::span<const PrimRef> refs) {
    float largest = 0;
    for (const PrimRef& ref : refs) largest = std::max(largest, ref.area());
    return largest;
}

PartSize split_by_area(std::span<const PrimRef> refs, PrimRef* out, std::size_t triangles,
                       const PartSize& other, float& largest) {
    const float least = kLargeArea * other.cost / (static_cast<float>(triangles) + 2 * kPartCost);
    if (largest < least) return {};
    largest = largest_area(refs);
    if (largest < least) return {};

    RefSum bins[kAreaBins];
    const auto bin_of = [most = key_of(largest)](const PrimRef& ref) {
        return std::min(most - key_of(ref.area()), kAreaBins - 1);
    };
    for (const PrimRef& ref : refs) bins[bin_of(ref)].add({ref.box(), 1, ref.triangle_count()});
    float right_cost[kAreaBins];
    RefSum right;
    for (std::uint32_t i = kAreaBins; --i > 0;) {
        right.add(bins[i]);
        right_cost[i] = right.cost();
    }
    PartSize best;
    std::uint32_t place = 0;
    RefSum left;
    for (std::uint32_t i = 1; i < kAreaBins; ++i) {
        left.add(bins[i - 1]);
        const float cost = left.cost() + right_cost[i];
        if (left.refs == refs.size() || cost >= std::min(best.cost, other.cost)) continue;
        best = {left.refs, left.triangles, cost};
        place = i;
    }
    PrimRef* large = out;
    PrimRef* small = out + best.triangles;
    if (place > 0) {
        for (const PrimRef& ref : refs) *(bin_of(ref) < place ? large : small)++ = ref;
    }
    return best;
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
            pair.set_area();
            if (pair.area() <= kPairArea * (ref.area() + next.area())) {
                pair.make_pair_of(ref.prim_id());
                ref = pair;
                ++i;
            }
        }
        refs[count++] = ref;
    }
    return count;
}

std::span<PrimRef> make_paired_refs(const Topology& topology, std::span<const vec3> positions,
                                    PrimRef* first, PrimRef* second, const SimdTarget& target,
                                    const Watch& watch) {
    const std::size_t triangles = topology.triangles.size();
    // Where the refs of each task begin, once all are known.
    std::vector<std::size_t> place((triangles + kPairingTask - 1) / kPairingTask + 1, 0);
    const auto for_each_task = [&](auto step) {
        tbb::parallel_for(std::size_t{0}, place.size() - 1, [&](std::size_t i) {
            watch.throw_if_cancelled();
            step(i, i * kPairingTask);
        });
    };
    for_each_task([&](std::size_t i, std::size_t begin) {
        const std::span refs(first + begin, std::min(kPairingTask, triangles - begin));
        make_refs(topology, positions, static_cast<std::uint32_t>(begin), refs, target);
        place[i + 1] = pair_refs(topology, refs);
    });
    for (std::size_t i = 1; i < place.size(); ++i) place[i] += place[i - 1];
    if (place.back() == triangles) return {first, triangles};
    for_each_task([&](std::size_t i, std::size_t begin) {
        std::copy_n(first + begin, place[i + 1] - place[i], second + place[i]);
    });
    return {second, place.back()};
}

void open_pairs(const Topology& topology, std::span<const vec3> positions, PrimRef* refs,
                std::size_t count, std::size_t triangles, const SimdTarget& target) {
    PrimRef* to = refs + triangles;
    while (count-- > 0) {
        const PrimRef ref = refs[count];
        const std::span own(to -= ref.triangle_count(), ref.triangle_count());
        make_refs(topology, positions, ref.prim_id(), own, target);
    }
}

}  // namespace mray

#endif  // HWY_ONCE
