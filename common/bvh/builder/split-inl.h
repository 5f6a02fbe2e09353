// Splits by bins and splits that try every position of every axis, compiled once for each target.
#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include "common/bvh/builder/split_cost-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray {
namespace HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

// ---- Bins

template <std::size_t kBins>
HWY_INLINE void clear(Bins<kBins>& bins) {
    for (Bin& bin : bins.bin) {
        for (float* const planes : bin.planes) store(splat8(kEmptyPlane), planes);
        store(splat4(0), bin.count);
    }
}

template <std::size_t kBins>
class BinFiller {
public:
    HWY_INLINE BinFiller(const Binning& binning, Bins<kBins>& bins)
        : bins_(reinterpret_cast<std::byte*>(bins.bin)),
          lower_(load4(binning.lower)),
          scale_(load4(binning.scale)) {}

    HWY_INLINE void add(std::span<const PrimRef> refs) const {
        // A bin takes long to find, and while one is not found, the loads after its store wait. So
        // those of a block are found first (lab/notes/build_and_refit.md).
        constexpr std::size_t kBlock = 16;
        Offsets offsets[kBlock][4];
        // Neighbours in the list are often neighbours in space, and a bin has to be stored before
        // it can be extended again: so the next ref comes from another quarter.
        const std::size_t quarter = refs.size() / 4;
        for (std::size_t begin = 0; begin < quarter; begin += kBlock) {
            const PrimRef* const block = &refs[begin];
            const std::size_t count = std::min(kBlock, quarter - begin);
            for (std::size_t i = 0; i < count; ++i) {
                for (std::size_t k = 0; k < 4; ++k) find(block[k * quarter + i], offsets[i][k]);
            }
            for (std::size_t i = 0; i < count; ++i) {
                for (std::size_t k = 0; k < 4; ++k) extend(offsets[i][k], block[k * quarter + i]);
            }
        }
        for (const PrimRef& ref : refs.subspan(4 * quarter)) {
            find(ref, offsets[0][0]);
            extend(offsets[0][0], ref);
        }
    }

private:
    /// Those of a ref's bins along the three axes, in bytes.
    struct alignas(16) Offsets {
        std::int32_t axis[4];
    };

    HWY_INLINE void find(const PrimRef& ref, Offsets& offsets) const {
        constexpr int kBinShift = std::countr_zero(sizeof(Bin));
        static_assert(sizeof(Bin) == 1 << kBinShift);
        // An empty box has centroid 0, which may lie outside the bounds.
        const Float4 centroid2 = load4(ref.planes) - load4(ref.planes + 4);
        const Float4 bin = min(max((centroid2 - lower_) * scale_, least_), most_);
        store(floor_shifted<kBinShift>(bin), offsets.axis);
    }
    HWY_INLINE void extend(const Offsets& offsets, const PrimRef& ref) const {
        const Float8 own = load8(ref.planes);
        const auto triangles = static_cast<std::int32_t>(ref.triangle_count());
        for (int axis = 0; axis < 3; ++axis) {
            Bin& b = *reinterpret_cast<Bin*>(bins_ + offsets.axis[axis]);
            store(min(load8(b.planes[axis]), own), b.planes[axis]);
            b.count[axis] += triangles;
        }
    }

    std::byte* bins_;
    Float4 lower_;
    Float4 scale_;
    Float4 least_ = splat4(0.0f);
    Float4 most_ = splat4(static_cast<float>(kBins - 1));
};

/// The boundary with the least sum of part_costs on both sides; position 0 if there is none.
template <std::size_t kBins>
HWY_INLINE Split best_boundary(const Bins<kBins>& bins) {
    Float4 right_cost[kBins];
    AxisBoxes right;
    Int4 count = splat4(0);
    for (std::size_t i = kBins; --i > 0;) {
        right.extend(bins.bin[i]);
        count = count + load4(bins.bin[i].count);
        right_cost[i] = part_costs(right, count);
    }
    const Int4 none = splat4(0);
    const Int4 total = count + load4(bins.bin[0].count);
    AxisBoxes left;
    count = none;
    CheapestPlaces places;
    for (std::size_t i = 1; i < kBins; ++i) {
        left.extend(bins.bin[i - 1]);
        count = count + load4(bins.bin[i - 1].count);
        places.consider(differ(count, none) & differ(count, total),
                        part_costs(left, count) + right_cost[i], i, count);
    }
    return places.best();
}

/// Whether a ref is left of a boundary of bins. Comparing with the position, which is in [1, bins),
/// gives the same sides as the bins do: neither rounding down nor clamping to [0, bins - 1] takes a
/// number past such an integer.
class LeftOf {
public:
    HWY_INLINE LeftOf(const Split& split, const Binning& binning)
        : axis_(split.axis),
          lower_(binning.lower[split.axis]),
          scale_(binning.scale[split.axis]),
          end_(static_cast<float>(static_cast<int>(split.position))) {}

    HWY_INLINE bool operator()(const PrimRef& ref) const {
        return (ref.centroid2(axis_) - lower_) * scale_ < end_;
    }

private:
    int axis_;
    float lower_;
    float scale_;
    float end_;
};

PartSize split_at_once(std::span<const PrimRef> refs, PrimRef* out) {
    const Binning binning(bound_centroids(refs), kFewBins);
    FewBins bins;
    clear(bins);
    BinFiller<kFewBins>(binning, bins).add(refs);
    const Split best = best_boundary(bins);
    if (best.position == 0) return {};
    return {partition_refs(refs, out, 0, best.left_size, LeftOf(best, binning)), best.left_size};
}

// ---- The steps of a set that is split in chunks

void bin_chunk(std::span<const PrimRef> refs, const Binning& binning, ManyBins& bins) {
    clear(bins);
    BinFiller<kManyBins>(binning, bins).add(refs);
}

Split best_of_chunks(std::span<const ManyBins> chunks) {
    ManyBins sum = chunks[0];
    for (const ManyBins& chunk : chunks.subspan(1)) {
        for (std::size_t i = 0; i < kManyBins; ++i) {
            Bin& to = sum.bin[i];
            const Bin& from = chunk.bin[i];
            for (int axis = 0; axis < 3; ++axis)
                store(min(load8(to.planes[axis]), load8(from.planes[axis])), to.planes[axis]);
            store(load4(to.count) + load4(from.count), to.count);
        }
    }
    return best_boundary(sum);
}

std::size_t count_left(std::span<const PrimRef> refs, const Binning& binning, const Split& split) {
    const LeftOf is_left(split, binning);
    std::size_t count = 0;
    for (const PrimRef& ref : refs) count += is_left(ref) ? 1 : 0;
    return count;
}

void divide_chunk(std::span<const PrimRef> refs, PrimRef* out, std::size_t left_index,
                  std::size_t right_index, const Binning& binning, const Split& split) {
    partition_refs(refs, out, left_index, right_index, LeftOf(split, binning));
}

// ---- Every position

static_assert(kFewRefs % kMaxLanes == 0);

/// Writes to rank[i] how many of c[0 .. size) come before c[i], equal ones by their index. Both
/// arrays have room for a multiple of kLanes; c[size ..) is +infinity.
HWY_INLINE void rank_all(const float* c, std::size_t size, std::int32_t* rank) {
    for (std::size_t block = 0; block < size; block += kLanes) {
        const FloatVec own = load(c + block);
        const auto first = static_cast<std::int32_t>(block);
        const auto end = static_cast<std::int32_t>(std::min<std::size_t>(block + kLanes, size));
        const IntVec index = hn::Iota(kInts, first);
        IntVec sum = splat(0);
        for (std::size_t j = 0; j < block; ++j) sum = increment(sum, splat(c[j]) <= own);
        for (std::int32_t j = first; j < end; ++j) {
            const FloatVec other = splat(c[j]);
            sum = increment(sum, (other < own) | ((other == own) & float_mask(splat(j) < index)));
        }
        for (std::size_t j = block + kLanes; j < size; ++j) sum = increment(sum, splat(c[j]) < own);
        store(sum, rank + block);
    }
}

/// The indices of at most kFewRefs refs by centroid, then by index, along each axis.
struct AxisOrders {
    alignas(64) std::int32_t rank[3][kFewRefs];
    std::uint8_t index[kFewRefs][3];
    /// The triangle_count of the ref at each place of each axis; the fourth is 0.
    alignas(16) std::int32_t triangles[kFewRefs][4];

    HWY_INLINE explicit AxisOrders(std::span<const PrimRef> refs) {
        const std::size_t size = refs.size();
        alignas(64) float centroids[3][kFewRefs];
        for (std::size_t i = 0; i < size; ++i) {
            for (int axis = 0; axis < 3; ++axis) centroids[axis][i] = refs[i].centroid2(axis);
        }
        for (int axis = 0; axis < 3; ++axis) {
            std::fill(centroids[axis] + size,
                      centroids[axis] + (size + kLanes - 1) / kLanes * kLanes,
                      std::numeric_limits<float>::infinity());
            rank_all(centroids[axis], size, rank[axis]);
            for (std::size_t i = 0; i < size; ++i) {
                const std::int32_t place = rank[axis][i];
                index[place][axis] = static_cast<std::uint8_t>(i);
                triangles[place][axis] = static_cast<std::int32_t>(refs[i].triangle_count());
            }
        }
        for (std::size_t i = 0; i < size; ++i) triangles[i][3] = 0;
    }
};

PartSize split_few(std::span<const PrimRef> refs, PrimRef* out) {
    const std::size_t size = refs.size();
    const Box bounds = bound_centroids(refs);
    const AxisOrders orders(refs);
    Float4 right_cost[kFewRefs];
    AxisBoxes right;
    Int4 count = splat4(0);
    for (std::size_t i = size; --i > 0;) {
        for (int axis = 0; axis < 3; ++axis) right.extend(axis, refs[orders.index[i][axis]].planes);
        count = count + load4(orders.triangles[i]);
        right_cost[i] = part_costs(right, count);
    }
    alignas(16) const float lower[4] = {bounds.lower.x, bounds.lower.y, bounds.lower.z, 0};
    alignas(16) const float upper[4] = {bounds.upper.x, bounds.upper.y, bounds.upper.z, 0};
    const Mask4 centroids_differ = load4(lower) < load4(upper);
    AxisBoxes left;
    count = splat4(0);
    CheapestPlaces places;
    for (std::size_t i = 1; i < size; ++i) {
        for (int axis = 0; axis < 3; ++axis)
            left.extend(axis, refs[orders.index[i - 1][axis]].planes);
        count = count + load4(orders.triangles[i - 1]);
        places.consider(centroids_differ, part_costs(left, count) + right_cost[i], i, count);
    }
    const Split best = places.best();
    if (best.position == 0) return {};
    const std::int32_t* rank = orders.rank[best.axis];
    const auto position = static_cast<std::int32_t>(best.position);
    partition_refs(refs, out, 0, best.left_size, [=](const PrimRef& ref) HWY_ATTR {
        return rank[&ref - refs.data()] < position;
    });
    return {best.position, best.left_size};
}

}  // namespace HWY_NAMESPACE
}  // namespace mray
HWY_AFTER_NAMESPACE();
