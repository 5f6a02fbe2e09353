// split_binned, compiled once for each kind of registers: SPLIT_NAMESPACE is its name,
// SPLIT_FUNCTION the attributes of functions that use them, SPLIT_EIGHT_LANES whether they hold
// eight floats. Templates of other headers are instantiated outside of such functions, or inlined.

namespace morphray {
namespace {
namespace SPLIT_NAMESPACE {

#if SPLIT_EIGHT_LANES

using float8 __attribute__((vector_size(32))) = float;

/// lower and -upper in one register: a union is one minimum. No coordinate is -0, so it has the
/// bits of two.
struct BinBox {
    float8 planes;

    SPLIT_FUNCTION static BinBox none() {
        constexpr float k = kEmptyPlane;
        return {float8{k, k, k, k, k, k, k, k}};
    }
    SPLIT_FUNCTION static BinBox of(const PrimRef& ref) {
        return {__builtin_shufflevector(ref.lower, -ref.upper, 0, 1, 2, 3, 4, 5, 6, 7)};
    }
    SPLIT_FUNCTION void extend(const BinBox& b) { planes = planes < b.planes ? planes : b.planes; }
    SPLIT_FUNCTION float4 extent() const {
        const float4 lower = __builtin_shufflevector(planes, planes, 0, 1, 2, 3);
        const float4 minus_upper = __builtin_shufflevector(planes, planes, 4, 5, 6, 7);
        return max(-(minus_upper + lower), float4{});
    }
};

#else

struct BinBox {
    Box4 planes;

    static BinBox none() { return {Box4::none()}; }
    static BinBox of(const PrimRef& ref) { return {ref.box()}; }
    void extend(const BinBox& b) { planes.extend(b.planes); }
    float4 extent() const { return planes.extent(); }
};

#endif

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
            min(max(bin, float4{}), splat(static_cast<float>(kBins - 1))), int4);
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
    BinBox box[kBins][3];
    /// An axis is a lane; lane 3 is 0.
    int4 count[kBins];

    SPLIT_FUNCTION void clear() {
        for (std::size_t i = 0; i < kBins; ++i) {
            for (BinBox& b : box[i]) b = BinBox::none();
            count[i] = int4{};
        }
    }
    SPLIT_FUNCTION void add(std::span<const PrimRef> refs, const Binning<kBins>& binning) {
        // Neighbours in the list are often neighbours in space, and a bin has to be stored before
        // it can be extended again: so the next one comes from elsewhere.
        const std::size_t quarter = refs.size() / 4;
        for (std::size_t i = 0; i < quarter; ++i) {
            for (std::size_t k = 0; k < 4; ++k) add(refs[k * quarter + i], binning);
        }
        for (std::size_t i = 4 * quarter; i < refs.size(); ++i) add(refs[i], binning);
    }
    SPLIT_FUNCTION void add(const PrimRef& ref, const Binning<kBins>& binning) {
        const int4 bin = binning(ref);
        const BinBox own = BinBox::of(ref);
        for (int axis = 0; axis < 3; ++axis) {
            const auto i = static_cast<std::uint32_t>(bin[axis]);
            box[i][axis].extend(own);
            ++reinterpret_cast<std::int32_t*>(&count[i])[axis];
        }
    }
    SPLIT_FUNCTION void add(const Bins& other) {
        for (std::size_t i = 0; i < kBins; ++i) {
            for (int axis = 0; axis < 3; ++axis) box[i][axis].extend(other.box[i][axis]);
            count[i] += other.count[i];
        }
    }
    std::size_t count_below(std::size_t position, int axis) const {
        std::size_t sum = 0;
        for (std::size_t i = 0; i < position; ++i)
            sum += static_cast<std::uint32_t>(count[i][axis]);
        return sum;
    }
};

/// part_cost of a box and a number for each axis, which is a lane; in its operations.
SPLIT_FUNCTION inline float4 part_costs(const BinBox* boxes, int4 count) {
    const float4 a = boxes[0].extent();
    const float4 b = boxes[1].extent();
    const float4 c = boxes[2].extent();
    const float4 xy = __builtin_shufflevector(a, b, 0, 4, 1, 5);
    const float4 z = __builtin_shufflevector(a, b, 2, 6, 2, 6);
    const float4 dx = __builtin_shufflevector(xy, c, 0, 1, 4, 4);
    const float4 dy = __builtin_shufflevector(xy, c, 2, 3, 5, 5);
    const float4 dz = __builtin_shufflevector(z, c, 0, 1, 6, 6);
    const float4 area = dx * dy + dy * dz + dz * dx;
    return area * (__builtin_convertvector(count, float4) + splat(kPartCost));
}

/// Sum of area times count on both sides of every boundary; of the cheapest the first, by axis and
/// then by position.
template <std::size_t kBins>
SPLIT_FUNCTION Split best_boundary(const Bins<kBins>& bins) {
    std::array<float4, kBins> right_cost;
    BinBox box[3] = {BinBox::none(), BinBox::none(), BinBox::none()};
    int4 count = {};
    for (std::size_t i = kBins; --i > 0;) {
        for (int axis = 0; axis < 3; ++axis) box[axis].extend(bins.box[i][axis]);
        count += bins.count[i];
        right_cost[i] = part_costs(box, count);
    }
    const int4 total = count + bins.count[0];
    for (BinBox& b : box) b = BinBox::none();
    count = int4{};
    float4 best_cost = splat(std::numeric_limits<float>::infinity());
    int4 best_position = {};
    int4 best_count = {};
    for (std::size_t i = 1; i < kBins; ++i) {
        for (int axis = 0; axis < 3; ++axis) box[axis].extend(bins.box[i - 1][axis]);
        count += bins.count[i - 1];
        const float4 cost = part_costs(box, count) + right_cost[i];
        const int4 better = (cost < best_cost) & (count != 0) & (count != total);
        const auto position = static_cast<std::int32_t>(i);
        best_cost = better ? cost : best_cost;
        best_position = better ? int4{position, position, position, position} : best_position;
        best_count = better ? count : best_count;
    }
    Split best;
    for (int axis = 0; axis < 3; ++axis) {
        best.consider({best_cost[axis], axis, static_cast<std::uint32_t>(best_position[axis]),
                       static_cast<std::uint32_t>(best_count[axis])});
    }
    return best;
}

SPLIT_FUNCTION Box4 bound_chunk(std::span<const PrimRef> refs) { return centroid_bounds(refs); }

SPLIT_FUNCTION void bin_chunk(std::span<const PrimRef> refs, const Binning<kManyBins>& binning,
                              Bins<kManyBins>& bins) {
    bins.clear();
    bins.add(refs, binning);
}

SPLIT_FUNCTION void divide_chunk(std::span<const PrimRef> refs, PrimRef* out,
                                 std::size_t left_index, std::size_t right_index,
                                 const Binning<kManyBins>& binning, const Split& split) {
    partition(refs, out, left_index, right_index, binning.is_left_of(split));
}

SPLIT_FUNCTION Split merge_chunks(std::span<Bins<kManyBins>> bins, Bins<kManyBins>& all) {
    all.clear();
    for (const Bins<kManyBins>& some : bins) all.add(some);
    return best_boundary(all);
}

/// Boxes and counts do not depend on the order in which chunks are added, nor places on who writes
/// them: so neither does the result on the number of threads.
std::size_t split_in_chunks(std::span<const PrimRef> refs, PrimRef* out) {
    const std::size_t chunk_count = (refs.size() + kChunk - 1) / kChunk;
    const auto chunk = [&](std::size_t i) {
        return refs.subspan(i * kChunk, std::min(kChunk, refs.size() - i * kChunk));
    };
    std::vector<Box4> bounds(chunk_count);
    tbb::parallel_for(std::size_t{0}, chunk_count,
                      [&](std::size_t i) { bounds[i] = bound_chunk(chunk(i)); });
    for (std::size_t i = 1; i < chunk_count; ++i) bounds[0].extend(bounds[i]);
    const Binning<kManyBins> binning(bounds[0]);
    AlignedVector<Bins<kManyBins>> bins(chunk_count + 1);
    tbb::parallel_for(std::size_t{0}, chunk_count,
                      [&](std::size_t i) { bin_chunk(chunk(i), binning, bins[i]); });
    const Split best = merge_chunks(std::span(bins).first(chunk_count), bins[chunk_count]);
    if (best.position == 0) return 0;

    std::vector<std::size_t> left_before(chunk_count + 1, 0);
    for (std::size_t i = 0; i < chunk_count; ++i)
        left_before[i + 1] = left_before[i] + bins[i].count_below(best.position, best.axis);
    tbb::parallel_for(std::size_t{0}, chunk_count, [&](std::size_t i) {
        divide_chunk(chunk(i), out, left_before[i], best.left_size + i * kChunk - left_before[i],
                     binning, best);
    });
    return best.left_size;
}

SPLIT_FUNCTION std::size_t split_at_once(std::span<const PrimRef> refs, PrimRef* out) {
    const Binning<kFewBins> binning(centroid_bounds(refs));
    Bins<kFewBins> bins;
    bins.clear();
    bins.add(refs, binning);
    const Split best = best_boundary(bins);
    if (best.position == 0) return 0;
    partition(refs, out, 0, best.left_size, binning.is_left_of(best));
    return best.left_size;
}

std::size_t split_binned(std::span<const PrimRef> refs, PrimRef* out) {
    return refs.size() >= 2 * kChunk ? split_in_chunks(refs, out) : split_at_once(refs, out);
}

}  // namespace SPLIT_NAMESPACE
}  // namespace
}  // namespace morphray
