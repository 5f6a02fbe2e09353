#include "common/split.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <limits>
#include <vector>

namespace morphray {
namespace {

// Sets of two chunks or more are bounded, binned and divided by chunks, each a task.
constexpr std::size_t kChunk = 8192;

/// The cheapest place found so far.
struct Split {
    float cost = std::numeric_limits<float>::infinity();
    int axis = 0;
    std::size_t position = 0;
    std::size_t left_size = 0;

    void consider(const Split& other) {
        if (other.cost < cost) *this = other;
    }
};

// What a part costs besides its triangles, in triangle tests: the node that it is in. Trees come
// out 0.4 to 2 % cheaper than with 0; still more makes cheaper ones, but of smaller leaves
// (docs/layout.md, "Building and refitting").
constexpr float kPartCost = 12;

/// What a part of a split costs: half its area (0 if it is empty) times what is in it.
float part_cost(const Box4& box, std::size_t count) {
    const float4 d = box.extent();
    const float4 products = d * __builtin_shufflevector(d, d, 1, 2, 0, 3);
    return (products[0] + products[1] + products[2]) *
           (static_cast<float>(static_cast<std::int32_t>(count)) + kPartCost);
}

Box4 centroid_bounds(std::span<const PrimRef> refs) {
    Box4 bounds = Box4::none();
    for (const PrimRef& ref : refs) {
        if (!ref.empty()) bounds.extend(ref.centroid2());
    }
    return bounds;
}

/// An order on triangles without ties.
struct ByCentroid {
    int axis;
    bool operator()(const PrimRef& a, const PrimRef& b) const {
        const float ca = a.centroid2(axis);
        const float cb = b.centroid2(axis);
        return ca < cb || (ca == cb && a.prim_id() < b.prim_id());
    }
};

/// Writes refs to `out` from left_index on if `goes_left`, else from right_index on. No branch on
/// what is as good as random.
template <class GoesLeft>
void partition(std::span<const PrimRef> refs, PrimRef* out, std::size_t left_index,
               std::size_t right_index, GoesLeft goes_left) {
    for (const PrimRef& ref : refs) {
        const std::size_t is_left = goes_left(ref) ? 1 : 0;
        out[right_index ^ ((left_index ^ right_index) & -is_left)] = ref;
        left_index += is_left;
        right_index += 1 - is_left;
    }
}

/// Divides by the order along an axis, `position` refs to the left.
std::size_t divide_by_order(std::span<const PrimRef> refs, int axis, std::size_t position,
                            PrimRef* out) {
    std::vector<PrimRef> order(refs.begin(), refs.end());
    const auto pivot = order.begin() + static_cast<std::ptrdiff_t>(position);
    std::nth_element(order.begin(), pivot, order.end(), ByCentroid{axis});
    partition(refs, out, 0, position, [&, first_right = *pivot](const PrimRef& ref) {
        return ByCentroid{axis}(ref, first_right);
    });
    return position;
}

// ---- bins

// Bins an axis for large sets, which take little of the time, and for others: more of them than 16
// would make the build 7 % slower and the tree no better (docs/layout.md, "Building and
// refitting").
constexpr std::size_t kManyBins = 32;
constexpr std::size_t kFewBins = 16;

/// Maps twice a centroid to its bin along each axis.
template <std::size_t kBins>
class Binning {
public:
    explicit Binning(const Box4& bounds) : lower_(bounds.lower) {
        const float4 extent = bounds.upper - bounds.lower;
        // A hair less than kBins, so that the largest centroid falls into the last bin. All that
        // do not differ along an axis are in its first one.
        const float4 divisor = extent > float4{} ? extent : splat(1);
        const float4 scale = splat(static_cast<float>(kBins) * 0.9999f) / divisor;
        scale_ = extent > float4{} ? scale : float4{};
        scale_[3] = 0;
    }

    int4 operator()(const PrimRef& ref) const {
        // An empty box (no finite vertex) has centroid 0, which may lie outside the bounds.
        const float4 bin = (ref.centroid2() - lower_) * scale_;
        return __builtin_convertvector(
            min(splat(static_cast<float>(kBins - 1)), max(float4{}, bin)), int4);
    }

    /// Whether a ref's bin is below the split's position, which is in [1, kBins): neither rounding
    /// down nor moving the ends of the range to 0 and kBins - 1 takes a number past such an
    /// integer.
    auto is_left_of(const Split& split) const {
        return [axis = split.axis, lower = lower_[split.axis], scale = scale_[split.axis],
                end = static_cast<float>(static_cast<int>(split.position))](const PrimRef& ref) {
            return (ref.centroid2(axis) - lower) * scale < end;
        };
    }

private:
    float4 lower_;
    float4 scale_;
};

/// The boxes and numbers of the refs in each bin of each axis.
template <std::size_t kBins>
struct Bins {
    Box4 box[3][kBins];
    std::uint32_t count[3][kBins];

    Bins() : count{} { std::fill_n(&box[0][0], kBins * 3, Box4::none()); }

    void add(std::span<const PrimRef> refs, const Binning<kBins>& binning) {
        // Neighbours in the list are often neighbours in space, and a bin has to be stored before
        // it can be extended again: so the next one comes from elsewhere.
        const std::size_t quarter = refs.size() / 4;
        for (std::size_t i = 0; i < quarter; ++i) {
            for (std::size_t k = 0; k < 4; ++k) add(refs[k * quarter + i], binning);
        }
        for (std::size_t i = 4 * quarter; i < refs.size(); ++i) add(refs[i], binning);
    }
    void add(const PrimRef& ref, const Binning<kBins>& binning) {
        const int4 bin = binning(ref);
        for (int axis = 0; axis < 3; ++axis) {
            const auto i = static_cast<std::uint32_t>(bin[axis]);
            box[axis][i].extend(ref.box());
            ++count[axis][i];
        }
    }
    void add(const Bins& other) {
        for (std::size_t i = 0; i < kBins; ++i) {
            for (int axis = 0; axis < 3; ++axis) {
                box[axis][i].extend(other.box[axis][i]);
                count[axis][i] += other.count[axis][i];
            }
        }
    }
    std::size_t count_below(std::size_t position, int axis) const {
        std::size_t sum = 0;
        for (std::size_t i = 0; i < position; ++i) sum += count[axis][i];
        return sum;
    }
};

/// Sum of area times count on both sides of every boundary; the first of the cheapest.
template <std::size_t kBins>
void best_boundary(const Bins<kBins>& bins, int axis, Split& best) {
    std::array<float, kBins> right_cost;
    Box4 box = Box4::none();
    std::uint32_t count = 0;
    for (std::size_t i = kBins; --i > 0;) {
        box.extend(bins.box[axis][i]);
        count += bins.count[axis][i];
        right_cost[i] = part_cost(box, count);
    }
    const std::uint32_t total = count + bins.count[axis][0];
    box = Box4::none();
    count = 0;
    for (std::size_t i = 1; i < kBins; ++i) {
        box.extend(bins.box[axis][i - 1]);
        count += bins.count[axis][i - 1];
        if (count == 0 || count == total) continue;
        best.consider({part_cost(box, count) + right_cost[i], axis, i, count});
    }
}

template <std::size_t kBins>
Split best_boundary(const Bins<kBins>& bins) {
    Split best;
    for (int axis = 0; axis < 3; ++axis) best_boundary(bins, axis, best);
    return best;
}

/// Boxes and counts do not depend on the order in which chunks are added, nor places on who writes
/// them: so neither does the result on the number of threads.
std::size_t split_binned_in_chunks(std::span<const PrimRef> refs, PrimRef* out) {
    const std::size_t chunk_count = (refs.size() + kChunk - 1) / kChunk;
    const auto chunk = [&](std::size_t i) {
        return refs.subspan(i * kChunk, std::min(kChunk, refs.size() - i * kChunk));
    };
    std::vector<Box4> bounds(chunk_count);
    tbb::parallel_for(std::size_t{0}, chunk_count,
                      [&](std::size_t i) { bounds[i] = centroid_bounds(chunk(i)); });
    for (std::size_t i = 1; i < chunk_count; ++i) bounds[0].extend(bounds[i]);
    const Binning<kManyBins> binning(bounds[0]);
    std::vector<Bins<kManyBins>> bins(chunk_count);
    tbb::parallel_for(std::size_t{0}, chunk_count,
                      [&](std::size_t i) { bins[i].add(chunk(i), binning); });
    Bins<kManyBins> all;
    for (const Bins<kManyBins>& some : bins) all.add(some);
    const Split best = best_boundary(all);
    if (best.position == 0) return 0;

    std::vector<std::size_t> left_before(chunk_count + 1, 0);
    for (std::size_t i = 0; i < chunk_count; ++i)
        left_before[i + 1] = left_before[i] + bins[i].count_below(best.position, best.axis);
    tbb::parallel_for(std::size_t{0}, chunk_count, [&](std::size_t i) {
        partition(chunk(i), out, left_before[i], best.left_size + i * kChunk - left_before[i],
                  binning.is_left_of(best));
    });
    return best.left_size;
}

// ---- all positions

void sweep_axis(std::span<PrimRef> refs, int axis, std::vector<float>& right_cost, Split& best) {
    std::sort(refs.begin(), refs.end(), ByCentroid{axis});
    Box4 box = Box4::none();
    for (std::size_t i = refs.size(); --i > 0;) {
        box.extend(refs[i].box());
        right_cost[i] = part_cost(box, refs.size() - i);
    }
    box = Box4::none();
    for (std::size_t i = 1; i < refs.size(); ++i) {
        box.extend(refs[i - 1].box());
        best.consider({part_cost(box, i) + right_cost[i], axis, i, i});
    }
}

/// rank[i]: how many of c[0 .. size) come before c[i], equal ones by their index. Both arrays have
/// room for a multiple of four; c[size ..) is +infinity.
void rank_all(const float* c, std::size_t size, std::int32_t* rank) {
    for (std::size_t block = 0; block < size; block += 4) {
        const float4 own = load4(c + block);
        const std::int32_t first = static_cast<std::int32_t>(block);
        const int4 index = {first, first + 1, first + 2, first + 3};
        int4 sum = {};
        // A comparison that holds is -1.
        for (std::size_t j = 0; j < block; ++j) sum -= splat(c[j]) <= own;
        for (std::int32_t j = first; j < first + 4; ++j) {
            const float4 other = splat(c[j]);
            sum -= (other < own) | ((other == own) & (j < index));
        }
        for (std::size_t j = block + 4; j < size; ++j) sum -= splat(c[j]) < own;
        __builtin_memcpy(rank + block, &sum, sizeof sum);
    }
}

}  // namespace

std::size_t split_binned(std::span<const PrimRef> refs, PrimRef* out) {
    if (refs.size() >= 2 * kChunk) return split_binned_in_chunks(refs, out);
    const Binning<kFewBins> binning(centroid_bounds(refs));
    Bins<kFewBins> bins;
    bins.add(refs, binning);
    const Split best = best_boundary(bins);
    if (best.position == 0) return 0;
    partition(refs, out, 0, best.left_size, binning.is_left_of(best));
    return best.left_size;
}

std::size_t split_sweep(std::span<const PrimRef> refs, PrimRef* out) {
    if (refs.size() <= kFewRefs) return split_few(refs, out);
    const Box4 bounds = centroid_bounds(refs);
    std::vector<PrimRef> order(refs.begin(), refs.end());
    std::vector<float> right_cost(refs.size());
    Split best;
    for (int axis = 0; axis < 3; ++axis) {
        if (bounds.upper[axis] > bounds.lower[axis]) sweep_axis(order, axis, right_cost, best);
    }
    return best.position == 0 ? 0 : divide_by_order(refs, best.axis, best.position, out);
}

std::size_t split_few(std::span<const PrimRef> refs, PrimRef* out) {
    const std::size_t size = refs.size();
    alignas(16) float centroids[3][kFewRefs];
    for (std::size_t i = 0; i < size; ++i) {
        const float4 c = refs[i].centroid2();
        for (int axis = 0; axis < 3; ++axis) centroids[axis][i] = c[axis];
    }
    const Box4 bounds = centroid_bounds(refs);
    std::int32_t ranks[3][kFewRefs];
    Split best;
    for (int axis = 0; axis < 3; ++axis) {
        if (!(bounds.upper[axis] > bounds.lower[axis])) continue;
        std::fill(centroids[axis] + size, centroids[axis] + (size + 3) / 4 * 4,
                  std::numeric_limits<float>::infinity());
        rank_all(centroids[axis], size, ranks[axis]);
        std::uint8_t order[kFewRefs];
        for (std::size_t i = 0; i < size; ++i) order[ranks[axis][i]] = static_cast<std::uint8_t>(i);
        float right_cost[kFewRefs];
        Box4 box = Box4::none();
        for (std::size_t i = size; --i > 0;) {
            box.extend(refs[order[i]].box());
            right_cost[i] = part_cost(box, size - i);
        }
        box = Box4::none();
        for (std::size_t i = 1; i < size; ++i) {
            box.extend(refs[order[i - 1]].box());
            best.consider({part_cost(box, i) + right_cost[i], axis, i, i});
        }
    }
    if (best.position == 0) return 0;
    const std::int32_t* rank = ranks[best.axis];
    partition(refs, out, 0, best.position, [&](const PrimRef& ref) {
        return rank[&ref - refs.data()] < static_cast<std::int32_t>(best.position);
    });
    return best.position;
}

std::size_t split_median(std::span<const PrimRef> refs, PrimRef* out) {
    const Box4 bounds = centroid_bounds(refs);
    const float4 extent = bounds.upper - bounds.lower;
    int widest = 0;
    for (int axis = 1; axis < 3; ++axis) {
        if (extent[axis] > extent[widest]) widest = axis;
    }
    return divide_by_order(refs, widest, refs.size() / 2, out);
}

}  // namespace morphray
