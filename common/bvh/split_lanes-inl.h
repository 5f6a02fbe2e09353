// split_binned and split_few, compiled once for each kind of registers: SPLIT_NAMESPACE is its
// name, SPLIT_FUNCTION the attributes of functions that use them, SPLIT_EIGHT_LANES whether they
// hold eight floats. Templates of other headers are instantiated outside of such functions, or
// inlined.

namespace morphray {
namespace {
namespace SPLIT_NAMESPACE {

#if SPLIT_EIGHT_LANES

using float8 __attribute__((vector_size(32))) = float;
/// Any 32 bytes as such: copied by memcpy they take a way through halves on the stack.
using float8_view __attribute__((vector_size(32), may_alias, aligned(16))) = float;

/// lower and -upper in one register: a union is one minimum. No coordinate is -0, so it has the
/// bits of two.
struct BinBox {
    float8 planes;

    SPLIT_FUNCTION static BinBox none() {
        constexpr float k = kEmptyPlane;
        return {float8{k, k, k, k, k, k, k, k}};
    }
    SPLIT_FUNCTION static BinBox of(const PrimRef& ref) {
        return {*reinterpret_cast<const float8_view*>(&ref)};
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

/// partition() in whole registers: what is stored in halves and soon loaded as a whole waits.
template <class GoesLeft>
SPLIT_FUNCTION void partition_refs(std::span<const PrimRef> refs, PrimRef* out,
                                   std::size_t left_index, std::size_t right_index,
                                   GoesLeft goes_left) {
    for (const PrimRef& ref : refs) {
        const std::size_t is_left = goes_left(ref) ? 1 : 0;
        PrimRef& to = out[right_index ^ ((left_index ^ right_index) & -is_left)];
#if SPLIT_EIGHT_LANES
        *reinterpret_cast<float8_view*>(&to) = *reinterpret_cast<const float8_view*>(&ref);
#else
        to = ref;
#endif
        left_index += is_left;
        right_index += 1 - is_left;
    }
}

/// Maps twice a centroid to its bin along each axis.
template <std::size_t kBins>
class Binning {
public:
    explicit Binning(const Box4& bounds) : lower_(bounds.lower) {
        const float4 extent = bounds.upper - bounds.lower;
        // A hair less than kBins, so that the largest centroid falls into the last bin. All that do
        // not differ along an axis are in its first one.
        const float4 divisor = extent > float4{} ? extent : splat4(1);
        const float4 scale = splat4(static_cast<float>(kBins) * 0.9999f) / divisor;
        scale_ = extent > float4{} ? scale : float4{};
        scale_[3] = 0;
    }

    int4 operator()(const PrimRef& ref) const {
        // An empty box (no finite vertex) has centroid 0, which may lie outside the bounds.
        const float4 bin = (ref.centroid2() - lower_) * scale_;
        return __builtin_convertvector(min(max(bin, least_), most_), int4);
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
    // Members, because g++ takes two or three instructions for a minimum with a literal.
    float4 least_ = float4{};
    float4 most_ = splat4(static_cast<float>(kBins - 1));
};

/// What is in a bin of each axis. Its size is a power of two, which finds it faster.
struct alignas(32) Bin {
    BinBox box[3];
    /// An axis is a lane; lane 3 is 0.
    int4 count;
};

template <std::size_t kBins>
struct Bins {
    Bin bin[kBins];

    SPLIT_FUNCTION void clear() {
        for (Bin& b : bin) {
            for (BinBox& box : b.box) box = BinBox::none();
            b.count = int4{};
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
        // The places of the three bins leave the vector registers as one number.
        using short8 __attribute__((vector_size(16))) = std::int16_t;
        using long2 __attribute__((vector_size(16))) = std::int64_t;
        const auto places =
            std::bit_cast<short8>(binning(ref) * static_cast<std::int32_t>(sizeof(Bin)));
        const auto low = __builtin_shufflevector(places, places, 0, 2, 4, 6, 0, 2, 4, 6);
        auto rest = static_cast<std::uint64_t>(std::bit_cast<long2>(low)[0]);
        const BinBox own = BinBox::of(ref);
        for (int axis = 0; axis < 3; ++axis, rest >>= 16) {
            Bin& b = *reinterpret_cast<Bin*>(reinterpret_cast<std::byte*>(bin) + (rest & 0xFFFF));
            b.box[axis].extend(own);
            ++b.count[axis];
        }
    }
    SPLIT_FUNCTION void add(const Bins& other) {
        for (std::size_t i = 0; i < kBins; ++i) {
            for (int axis = 0; axis < 3; ++axis) bin[i].box[axis].extend(other.bin[i].box[axis]);
            bin[i].count += other.bin[i].count;
        }
    }
    std::size_t count_below(std::size_t position, int axis) const {
        std::size_t sum = 0;
        for (std::size_t i = 0; i < position; ++i)
            sum += static_cast<std::uint32_t>(bin[i].count[axis]);
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
    return area * (__builtin_convertvector(count, float4) + splat4(kPartCost));
}

/// The cheapest place so far on each axis, which is a lane: the first of several.
struct CheapestPlaces {
    float4 cost = splat4(std::numeric_limits<float>::infinity());
    int4 position = {};
    int4 left_size = {};

    SPLIT_FUNCTION void consider(int4 allowed, float4 other_cost, std::size_t other_position,
                                 int4 other_left_size) {
        const int4 better = allowed & (other_cost < cost);
        const auto i = static_cast<std::int32_t>(other_position);
        cost = better ? other_cost : cost;
        position = better ? int4{i, i, i, i} : position;
        left_size = better ? other_left_size : left_size;
    }
    /// The first axis of several as cheap.
    SPLIT_FUNCTION Split best() const {
        Split split;
        for (int axis = 0; axis < 3; ++axis) {
            split.consider({cost[axis], axis, static_cast<std::uint32_t>(position[axis]),
                            static_cast<std::uint32_t>(left_size[axis])});
        }
        return split;
    }
};

// ---- bins

/// Sum of area times count on both sides of every boundary.
template <std::size_t kBins>
SPLIT_FUNCTION Split best_boundary(const Bins<kBins>& bins) {
    std::array<float4, kBins> right_cost;
    BinBox box[3] = {BinBox::none(), BinBox::none(), BinBox::none()};
    int4 count = {};
    for (std::size_t i = kBins; --i > 0;) {
        for (int axis = 0; axis < 3; ++axis) box[axis].extend(bins.bin[i].box[axis]);
        count += bins.bin[i].count;
        right_cost[i] = part_costs(box, count);
    }
    const int4 total = count + bins.bin[0].count;
    for (BinBox& b : box) b = BinBox::none();
    count = int4{};
    CheapestPlaces places;
    for (std::size_t i = 1; i < kBins; ++i) {
        for (int axis = 0; axis < 3; ++axis) box[axis].extend(bins.bin[i - 1].box[axis]);
        count += bins.bin[i - 1].count;
        places.consider((count != 0) & (count != total), part_costs(box, count) + right_cost[i], i,
                        count);
    }
    return places.best();
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
    partition_refs(refs, out, left_index, right_index, binning.is_left_of(split));
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
    partition_refs(refs, out, 0, best.left_size, binning.is_left_of(best));
    return best.left_size;
}

std::size_t split_binned(std::span<const PrimRef> refs, PrimRef* out) {
    return refs.size() >= 2 * kChunk ? split_in_chunks(refs, out) : split_at_once(refs, out);
}

// ---- every position

/// rank[i]: how many of c[0 .. size) come before c[i], equal ones by their index. Both arrays have
/// room for a multiple of four; c[size ..) is +infinity.
SPLIT_FUNCTION void rank_all(const float* c, std::size_t size, std::int32_t* rank) {
    for (std::size_t block = 0; block < size; block += 4) {
        const float4 own = load4(c + block);
        const std::int32_t first = static_cast<std::int32_t>(block);
        const int4 index = {first, first + 1, first + 2, first + 3};
        int4 sum = {};
        // A comparison that holds is -1.
        for (std::size_t j = 0; j < block; ++j) sum -= splat4(c[j]) <= own;
        for (std::int32_t j = first; j < first + 4; ++j) {
            const float4 other = splat4(c[j]);
            sum -= (other < own) | ((other == own) & (j < index));
        }
        for (std::size_t j = block + 4; j < size; ++j) sum -= splat4(c[j]) < own;
        __builtin_memcpy(rank + block, &sum, sizeof sum);
    }
}

SPLIT_FUNCTION std::size_t split_few(std::span<const PrimRef> refs, PrimRef* out) {
    const std::size_t size = refs.size();
    alignas(16) float centroids[3][kFewRefs];
    for (std::size_t i = 0; i < size; ++i) {
        const float4 c = refs[i].centroid2();
        for (int axis = 0; axis < 3; ++axis) centroids[axis][i] = c[axis];
    }
    const Box4 bounds = centroid_bounds(refs);
    const int4 differs = bounds.upper > bounds.lower;
    std::int32_t ranks[3][kFewRefs];
    std::uint8_t order[kFewRefs][3];
    for (int axis = 0; axis < 3; ++axis) {
        std::fill(centroids[axis] + size, centroids[axis] + (size + 3) / 4 * 4,
                  std::numeric_limits<float>::infinity());
        rank_all(centroids[axis], size, ranks[axis]);
        for (std::size_t i = 0; i < size; ++i)
            order[ranks[axis][i]][axis] = static_cast<std::uint8_t>(i);
    }
    std::array<float4, kFewRefs> right_cost;
    BinBox box[3] = {BinBox::none(), BinBox::none(), BinBox::none()};
    const auto number = [](std::size_t n) { return int4{} + static_cast<std::int32_t>(n); };
    for (std::size_t i = size; --i > 0;) {
        for (int axis = 0; axis < 3; ++axis) box[axis].extend(BinBox::of(refs[order[i][axis]]));
        right_cost[i] = part_costs(box, number(size - i));
    }
    for (BinBox& b : box) b = BinBox::none();
    CheapestPlaces places;
    for (std::size_t i = 1; i < size; ++i) {
        for (int axis = 0; axis < 3; ++axis) box[axis].extend(BinBox::of(refs[order[i - 1][axis]]));
        places.consider(differs, part_costs(box, number(i)) + right_cost[i], i, number(i));
    }
    const Split best = places.best();
    if (best.position == 0) return 0;
    const std::int32_t* rank = ranks[best.axis];
    partition_refs(refs, out, 0, best.position, [&](const PrimRef& ref) {
        return rank[&ref - refs.data()] < static_cast<std::int32_t>(best.position);
    });
    return best.position;
}

}  // namespace SPLIT_NAMESPACE
}  // namespace
}  // namespace morphray
