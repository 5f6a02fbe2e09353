// Splits by bins, compiled once for each target: loops over refs; the costs of splits for three
// axes at once; bins; the steps of a set that is split by a sample.
#include <algorithm>
#include <bit>
#include <limits>

#include "common/bvh/builder/split.h"
#include "common/simd/fixed_vectors-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray {
namespace HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

// ---- Refs

/// The first three lanes of each.
HWY_INLINE Box box_of(Float4 lower, Float4 upper) {
    alignas(16) float l[4];
    alignas(16) float u[4];
    store(lower, l);
    store(upper, u);
    return {{l[0], l[1], l[2]}, {u[0], u[1], u[2]}};
}

HWY_INLINE Float4 load_vertex(std::span<const vec3> positions, std::uint32_t vertex) {
    // Nothing may follow the last vertex in memory.
    if (vertex == positions.size() - 1) [[unlikely]] {
        const vec3 p = positions[vertex];
        alignas(16) const float lanes[4] = {p.x, p.y, p.z, 0};
        return load4(lanes);
    }
    return load4_unaligned(&positions[vertex].x);
}

inline void make_refs(const Topology& topology, std::span<const vec3> positions,
                      std::uint32_t first, std::span<PrimRef> refs) {
    for (std::size_t i = 0; i < refs.size(); ++i) {
        const auto prim_id = first + static_cast<std::uint32_t>(i);
        const uvec3 t = topology.triangles[prim_id];
        Float4 lower = splat4(kEmptyPlane);
        Float4 upper = splat4(-kEmptyPlane);
        for (const std::uint32_t vertex : {t.x, t.y, t.z}) {
            if (!is_finite_vertex(positions[vertex])) [[unlikely]]
                continue;
            const Float4 p = load_vertex(positions, vertex);
            lower = min(lower, p);
            upper = max(upper, p);
        }
        float* const planes = refs[i].planes;
        store(lower, planes);
        store(-upper, planes + 4);
        planes[3] = std::bit_cast<float>(PrimRef::kIdBits | prim_id);
        refs[i].set_area();
    }
}

inline Box union_of(std::span<const PrimRef> refs) {
    Float8 planes = splat8(kEmptyPlane);
    for (const PrimRef& ref : refs) planes = min(planes, load8(ref.planes));
    return box_of(low_half(planes), -high_half(planes));
}

/// The bounds of twice the centroids of those refs that are not empty; empty for none.
inline Box bound_centroids(std::span<const PrimRef> refs) {
    // Two of each, so that neither waits for the other.
    Float4 lower[2] = {splat4(kEmptyPlane), splat4(kEmptyPlane)};
    Float4 upper[2] = {splat4(-kEmptyPlane), splat4(-kEmptyPlane)};
    const auto add = [&](std::size_t i) HWY_ATTR {
        const PrimRef& ref = refs[i];
        if (ref.empty()) return;
        const Float4 centroid2 = load4(ref.planes) - load4(ref.planes + 4);
        lower[i % 2] = min(lower[i % 2], centroid2);
        upper[i % 2] = max(upper[i % 2], centroid2);
    };
    for (std::size_t i = 0; i + 1 < refs.size(); i += 2) {
        add(i);
        add(i + 1);
    }
    if (refs.size() % 2 != 0) add(refs.size() - 1);
    return box_of(min(lower[0], lower[1]), max(upper[0], upper[1]));
}

// ---- Costs

/// A box for each axis, as in PrimRef.
struct AxisBoxes {
    Float8 planes[3] = {splat8(kEmptyPlane), splat8(kEmptyPlane), splat8(kEmptyPlane)};

    // Not implicit: that one would not be compiled for the target.
    HWY_INLINE AxisBoxes() {}

    HWY_INLINE void extend(const Bin& bin) {
        for (int axis = 0; axis < 3; ++axis)
            planes[axis] = min(planes[axis], load8(bin.planes[axis]));
    }
};

/// lower - upper in the first three lanes, or 0 for an empty box.
HWY_INLINE Float4 minus_extent(Float8 planes) {
    return min(low_half(planes) + high_half(planes), splat4(0.0f));
}

/// The cost of a part for each axis: half the area of its box, times its triangles and part_cost.
HWY_INLINE Float4 part_costs(const AxisBoxes& boxes, Int4 count, float part_cost) {
    Float4 d[3];
    transpose3(minus_extent(boxes.planes[0]), minus_extent(boxes.planes[1]),
               minus_extent(boxes.planes[2]), d);
    const Float4 area = d[0] * d[1] + d[1] * d[2] + d[2] * d[0];
    return area * (to_float(count) + splat4(part_cost));
}

/// The cheapest split so far on each axis, which is a lane: the first of several.
struct CheapestSplits {
    Float4 cost = splat4(std::numeric_limits<float>::infinity());
    Int4 position = splat4(0);
    Int4 left_size = splat4(0);

    HWY_INLINE CheapestSplits() {}

    HWY_INLINE void consider(Mask4 allowed, Float4 other_cost, std::size_t other_position,
                             Int4 other_left_size) {
        const Mask4 better = allowed & (other_cost < cost);
        cost = select(better, other_cost, cost);
        position = select(better, splat4(static_cast<std::int32_t>(other_position)), position);
        left_size = select(better, other_left_size, left_size);
    }
    HWY_INLINE Split best() const {
        alignas(16) float costs[4];
        alignas(16) std::int32_t positions[4];
        alignas(16) std::int32_t left_sizes[4];
        store(cost, costs);
        store(position, positions);
        store(left_size, left_sizes);
        Split split;
        for (int axis = 0; axis < 3; ++axis) {
            split.consider({costs[axis], axis, static_cast<std::uint32_t>(positions[axis]),
                            static_cast<std::uint32_t>(left_sizes[axis])});
        }
        return split;
    }
};

/// Writes refs to `out` from left_index on if `goes_left`, else from right_index on; returns the
/// index after the last left one. Without a branch, as one would be mispredicted half of the time,
/// and in whole registers: what is stored in halves and soon loaded as a whole waits.
template <class GoesLeft>
HWY_INLINE std::size_t partition_refs(std::span<const PrimRef> refs, PrimRef* out,
                                      std::size_t left_index, std::size_t right_index,
                                      GoesLeft goes_left) {
    for (const PrimRef& ref : refs) {
        const std::size_t is_left = goes_left(ref) ? 1 : 0;
        PrimRef& to = out[right_index ^ ((left_index ^ right_index) & -is_left)];
        store(load8(ref.planes), to.planes);
        left_index += is_left;
        right_index += 1 - is_left;
    }
    return left_index;
}

// ---- Bins

/// The bins of a set of refs.
class Bins {
public:
    HWY_INLINE explicit Bins(const Binning& binning)
        : size_(binning.bins),
          lower_(load4(binning.lower)),
          scale_(load4(binning.scale)),
          most_(splat4(static_cast<float>(static_cast<int>(size_ - 1)))) {
        for (std::size_t i = 0; i < size_; ++i) {
            for (float* const planes : bins_[i].planes) store(splat8(kEmptyPlane), planes);
            store(splat4(0), bins_[i].count);
        }
    }

    HWY_INLINE std::size_t size() const { return size_; }
    HWY_INLINE const Bin& operator[](std::size_t i) const { return bins_[i]; }

    HWY_INLINE void add(std::span<const PrimRef> refs) {
        // A bin takes long to find, and meanwhile the loads after its store wait. So the bins of a
        // block are found first (lab/notes/build_and_refit.md).
        constexpr std::size_t kBlock = 16;
        Offsets offsets[kBlock][4];
        // Neighbours in the list are often neighbours in space, and a bin must be stored before it
        // can be extended again: so the next ref comes from another quarter.
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
    /// The offsets of a ref's bins along the three axes, in bytes.
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
    HWY_INLINE void extend(const Offsets& offsets, const PrimRef& ref) {
        const Float8 own = load8(ref.planes);
        const auto triangles = static_cast<std::int32_t>(ref.triangle_count());
        for (int axis = 0; axis < 3; ++axis) {
            Bin& b =
                *reinterpret_cast<Bin*>(reinterpret_cast<std::byte*>(bins_) + offsets.axis[axis]);
            store(min(load8(b.planes[axis]), own), b.planes[axis]);
            b.count[axis] += triangles;
        }
    }

    Bin bins_[kBins];
    std::size_t size_;
    Float4 lower_;
    Float4 scale_;
    Float4 least_ = splat4(0.0f);
    Float4 most_;
};

/// The boundary with the least sum of part_costs on both sides; position 0 if there is none.
HWY_INLINE Split best_boundary(const Bins& bins, float part_cost) {
    Float4 right_cost[kBins];
    AxisBoxes right;
    Int4 count = splat4(0);
    for (std::size_t i = bins.size(); --i > 0;) {
        right.extend(bins[i]);
        count = count + load4(bins[i].count);
        right_cost[i] = part_costs(right, count, part_cost);
    }
    const Int4 none = splat4(0);
    const Int4 total = count + load4(bins[0].count);
    AxisBoxes left;
    count = none;
    CheapestSplits splits;
    for (std::size_t i = 1; i < bins.size(); ++i) {
        left.extend(bins[i - 1]);
        count = count + load4(bins[i - 1].count);
        splits.consider(differ(count, none) & differ(count, total),
                        part_costs(left, count, part_cost) + right_cost[i], i, count);
    }
    return splits.best();
}

/// Tells refs left of a boundary of bins from the others. Comparing with the position, in
/// [1, kBins), gives the sides of the bins: neither rounding down nor clamping takes a number past
/// such an integer.
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

Split choose_boundary(std::span<const PrimRef> refs, float part_cost, Binning& binning) {
    binning = Binning(bound_centroids(refs), refs.size());
    Bins bins(binning);
    bins.add(refs);
    return best_boundary(bins, part_cost);
}

PartSize split_at_once(std::span<const PrimRef> refs, PrimRef* out) {
    Binning binning;
    const Split best = choose_boundary(refs, kPartCost, binning);
    if (best.position == 0) return {};
    return {partition_refs(refs, out, 0, best.left_size, LeftOf(best, binning)), best.left_size,
            best.cost};
}

// ---- The steps of a set that is split by a sample, in chunks

PartSize count_left(std::span<const PrimRef> refs, const Binning& binning, const Split& split) {
    const LeftOf is_left(split, binning);
    PartSize left;
    for (const PrimRef& ref : refs) {
        // No branch: it would be mispredicted half of the time.
        const std::uint32_t one = is_left(ref) ? 1 : 0;
        left.refs += one;
        left.triangles += -one & ref.triangle_count();
    }
    return left;
}

void divide_chunk(std::span<const PrimRef> refs, PrimRef* out, std::size_t left_index,
                  std::size_t right_index, const Binning& binning, const Split& split) {
    partition_refs(refs, out, left_index, right_index, LeftOf(split, binning));
}

}  // namespace HWY_NAMESPACE
}  // namespace mray
HWY_AFTER_NAMESPACE();
