// Splits by bins, compiled once for each target.
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

HWY_INLINE void clear(Bins& bins) {
    for (Bin& bin : bins) {
        for (float* const planes : bin.planes) store(splat8(kEmptyPlane), planes);
        store(splat4(0), bin.count);
    }
}

class BinFiller {
public:
    HWY_INLINE BinFiller(const Binning& binning, Bins& bins)
        : bins_(reinterpret_cast<std::byte*>(bins.data())),
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
HWY_INLINE Split best_boundary(const Bins& bins) {
    Float4 right_cost[kBins];
    AxisBoxes right;
    Int4 count = splat4(0);
    for (std::size_t i = kBins; --i > 0;) {
        right.extend(bins[i]);
        count = count + load4(bins[i].count);
        right_cost[i] = part_costs(right, count);
    }
    const Int4 none = splat4(0);
    const Int4 total = count + load4(bins[0].count);
    AxisBoxes left;
    count = none;
    CheapestPlaces places;
    for (std::size_t i = 1; i < kBins; ++i) {
        left.extend(bins[i - 1]);
        count = count + load4(bins[i - 1].count);
        places.consider(differ(count, none) & differ(count, total),
                        part_costs(left, count) + right_cost[i], i, count);
    }
    return places.best();
}

/// Whether a ref is left of a boundary of bins. Comparing with the position, which is in [1,
/// kBins), gives the same sides as the bins do: neither rounding down nor clamping to [0, kBins -
/// 1] takes a number past such an integer.
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
    const Binning binning(bound_centroids(refs));
    Bins bins;
    clear(bins);
    BinFiller(binning, bins).add(refs);
    const Split best = best_boundary(bins);
    if (best.position == 0) return {};
    return {partition_refs(refs, out, 0, best.left_size, LeftOf(best, binning)), best.left_size,
            best.cost};
}

// ---- The steps of a set that is split in chunks

void bin_chunk(std::span<const PrimRef> refs, const Binning& binning, Bins& bins) {
    clear(bins);
    BinFiller(binning, bins).add(refs);
}

Split best_of_chunks(std::span<const Bins> chunks) {
    Bins sum = chunks[0];
    for (const Bins& chunk : chunks.subspan(1)) {
        for (std::size_t i = 0; i < kBins; ++i) {
            Bin& to = sum[i];
            const Bin& from = chunk[i];
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

}  // namespace HWY_NAMESPACE
}  // namespace mray
HWY_AFTER_NAMESPACE();
