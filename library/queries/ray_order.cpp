#include "library/queries/ray_order.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

namespace morphray::detail {
namespace {

using mray::cpu::RayCurve;
using Coordinates = std::array<float, RayCurve::kCoordinates>;

constexpr std::size_t kOrgCoordinates = 3;
// Samples of neighbours.
constexpr std::size_t kPairs = 128;
// The range of a coordinate is that of the samples without this many at either end.
constexpr std::size_t kOutliers = kPairs / 64;
// Neighbours are alike if their distance is less than this part of that of other pairs.
constexpr double kNear = 1.0 / 8;
// Distances that are too small to matter, as parts of the scene's extent and of the octahedron.
constexpr double kNoDistance = 0x1p-10;

constexpr int kDigitBits = RayCurve::kKeyBits / 2;
constexpr std::size_t kDigits = std::size_t{1} << kDigitBits;
constexpr int kIndexBits = 32 - kDigitBits;
static_assert(RaySorter::kMost <= std::size_t{1} << kIndexBits);
// Rays that a thread counts and moves at a time.
constexpr std::size_t kBlock = std::size_t{1} << 14;

using Counts = std::array<std::uint32_t, kDigits>;

std::span<const mray::StoredRay> stored(std::span<const Ray> rays) {
    static_assert(sizeof(Ray) == sizeof(mray::StoredRay));
    return {reinterpret_cast<const mray::StoredRay*>(rays.data()), rays.size()};
}

struct Range {
    float lower = 0;
    float upper = 0;

    double size() const { return double{upper} - lower; }
    float cut(float x) const { return x > lower ? std::min(x, upper) : lower; }
};

/// The range of coordinate k of samples.
Range range_of(std::span<const Coordinates> samples, std::size_t k) {
    std::vector<float> values;
    values.reserve(samples.size());
    for (const Coordinates& sample : samples) {
        if (std::isfinite(sample[k])) values.push_back(sample[k]);
    }
    if (values.empty()) return {};
    std::sort(values.begin(), values.end());
    const std::size_t left_out = values.size() > 2 * kOutliers ? kOutliers : 0;
    return {values[left_out], values[values.size() - 1 - left_out]};
}

/// The sum of distances along some coordinates of pairs of samples.
class Distances {
public:
    Distances(std::span<const Range> ranges, std::size_t first, std::size_t end)
        : ranges_(ranges), first_(first), end_(end) {}

    void add(const Coordinates& a, const Coordinates& b) {
        for (std::size_t k = first_; k < end_; ++k)
            sum_ += std::abs(double{ranges_[k].cut(a[k])} - ranges_[k].cut(b[k]));
    }
    double mean() const { return sum_ / kPairs; }

private:
    std::span<const Range> ranges_;
    std::size_t first_;
    std::size_t end_;
    double sum_ = 0;
};

/// Whether neighbours are as far from each other as other samples, along some coordinates, or that
/// does not matter.
enum class Likeness { kAlike, kUnlike, kAll };

Likeness likeness(std::span<const Coordinates> samples, std::span<const Coordinates> next,
                  std::span<const Range> ranges, std::size_t first, std::size_t end,
                  double no_distance) {
    Distances near(ranges, first, end);
    Distances far(ranges, first, end);
    for (std::size_t i = 0; i < samples.size(); ++i) {
        near.add(samples[i], next[i]);
        far.add(samples[i], samples[(i + kPairs / 2) % kPairs]);
    }
    if (!(far.mean() > no_distance)) return Likeness::kAll;
    return near.mean() < kNear * far.mean() ? Likeness::kAlike : Likeness::kUnlike;
}

/// A curve over these ranges: each bit of a key halves the cells that are the longest so far.
RayCurve curve_over(std::span<const Range> ranges, double extent) {
    RayCurve curve;
    std::array<double, RayCurve::kCoordinates> length{};
    for (std::size_t k = 0; k < length.size(); ++k)
        length[k] = ranges[k].size() / (k < kOrgCoordinates ? extent : 1.0);
    std::array<std::vector<std::uint32_t>, RayCurve::kCoordinates> bits;
    for (int bit = RayCurve::kKeyBits - 1; bit >= 0; --bit) {
        const auto longest = std::max_element(length.begin(), length.end());
        const auto k = static_cast<std::size_t>(longest - length.begin());
        bits[k].push_back(1u << bit);
        // A coordinate that has kMostCells gets no more bits.
        *longest = std::size_t{1} << bits[k].size() < RayCurve::kMostCells ? *longest / 2 : -1;
    }
    for (std::size_t k = 0; k < length.size(); ++k) {
        const std::size_t cells = std::size_t{1} << bits[k].size();
        const double scale = static_cast<double>(cells) / ranges[k].size();
        curve.lower[k] = ranges[k].lower;
        curve.scale[k] = scale <= std::numeric_limits<float>::max() ? static_cast<float>(scale) : 0;
        curve.last[k] = static_cast<std::int32_t>(cells - 1);
        for (std::size_t cell = 0; cell < cells; ++cell) {
            for (std::size_t i = 0; i < bits[k].size(); ++i) {
                if ((cell >> (bits[k].size() - 1 - i) & 1) != 0) curve.bits[k][cell] |= bits[k][i];
            }
        }
    }
    return curve;
}

}  // namespace

RayOrder::RayOrder(std::span<const Ray> rays, double extent) {
    assert(rays.size() >= kLeast);
    std::array<Coordinates, kPairs> samples;
    std::array<Coordinates, kPairs> next;
    for (std::size_t i = 0; i < kPairs; ++i) {
        const std::size_t at = (rays.size() - 1) / kPairs * i;
        const std::span<const mray::StoredRay> pair = stored(rays.subspan(at, 2));
        samples[i] = mray::cpu::ray_coordinates(pair[0]);
        next[i] = mray::cpu::ray_coordinates(pair[1]);
    }
    std::array<Range, RayCurve::kCoordinates> ranges;
    for (std::size_t k = 0; k < ranges.size(); ++k) ranges[k] = range_of(samples, k);
    Likeness alike = likeness(samples, next, ranges, 0, kOrgCoordinates, kNoDistance * extent);
    if (alike == Likeness::kAll) {
        alike = likeness(samples, next, ranges, kOrgCoordinates, ranges.size(), kNoDistance);
    }
    is_needed_ = alike == Likeness::kUnlike;
    if (is_needed_) curve_ = curve_over(ranges, extent);
}

std::optional<mray::cpu::RayCurve> curve_to_sort(std::span<const Ray> rays, const RaySpace& space) {
    if (rays.size() < RayOrder::kLeast) return std::nullopt;
    const RayOrder order(rays, space.extent());
    if (!order.is_needed()) return std::nullopt;
    return order.curve();
}

void RaySorter::make_room(std::size_t rays) {
    assert(rays <= kMost);
    if (places_.size() >= rays) return;
    keys_.resize(rays);
    items_.resize(rays);
    places_.resize(rays);
}

std::span<const std::uint32_t> RaySorter::sort(std::span<const Ray> rays,
                                               const mray::cpu::RayKeys& ray_keys,
                                               mray::ThreadArena* arena) {
    assert(rays.size() <= places_.size());
    const std::size_t count = rays.size();
    // By the upper digit, in blocks; then each digit's rays by the lower one.
    std::array<Counts, kMost / kBlock> counts;
    const std::size_t blocks = (count + kBlock - 1) / kBlock;
    const auto end_of = [&](std::size_t block) { return std::min((block + 1) * kBlock, count); };
    for_each_part(arena, blocks, [&](std::size_t block) {
        const std::size_t begin = block * kBlock;
        const std::span keys = std::span(keys_).subspan(begin, end_of(block) - begin);
        ray_keys.find(stored(rays.subspan(begin, keys.size())), keys);
        counts[block].fill(0);
        for (const std::uint16_t key : keys) ++counts[block][key >> kDigitBits];
    });
    std::array<std::uint32_t, kDigits + 1> begins;
    std::uint32_t sum = 0;
    for (std::size_t digit = 0; digit < kDigits; ++digit) {
        begins[digit] = sum;
        for (std::size_t block = 0; block < blocks; ++block)
            sum += std::exchange(counts[block][digit], sum);
    }
    begins[kDigits] = sum;
    for_each_part(arena, blocks, [&](std::size_t block) {
        Counts& next = counts[block];
        for (std::size_t i = block * kBlock; i < end_of(block); ++i) {
            const std::uint32_t key = keys_[i];
            const auto index = static_cast<std::uint32_t>(i);
            items_[next[key >> kDigitBits]++] = key << kIndexBits | index;
        }
    });
    for_each_part(arena, kDigits, [&](std::size_t digit) {
        const std::span<const std::uint32_t> items =
            std::span(items_).subspan(begins[digit], begins[digit + 1] - begins[digit]);
        Counts next{};
        for (const std::uint32_t item : items) ++next[item >> kIndexBits];
        std::uint32_t place = begins[digit];
        for (std::uint32_t& n : next) place += std::exchange(n, place);
        constexpr std::uint32_t kIndexMask = (1u << kIndexBits) - 1;
        for (const std::uint32_t item : items)
            places_[next[item >> kIndexBits]++] = item & kIndexMask;
    });
    return std::span(places_).first(count);
}

std::unique_ptr<RaySorter> RaySorterStore::take() {
    const std::lock_guard lock(mutex_);
    return kept_ ? std::move(kept_) : std::make_unique<RaySorter>();
}

void RaySorterStore::keep(std::unique_ptr<RaySorter> sorter) {
    const std::lock_guard lock(mutex_);
    kept_ = std::move(sorter);
}

}  // namespace morphray::detail
