#include "library/src/ray_order.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>

#include <glm/common.hpp>
#include <glm/gtc/bitfield.hpp>

#include "library/src/ray_space.h"

namespace morphray::detail {
namespace {

using mray::cpu::RayCurve;
using Coordinates = std::array<float, RayCurve::kCoordinates>;

constexpr std::size_t kOrgCoordinates = 3;
constexpr std::size_t kSamples = 128;
// The range of a coordinate is that of the samples without this many at either end.
constexpr std::size_t kOutliers = kSamples / 64;

constexpr int kDigitBits = RayCurve::kKeyBits / 2;
constexpr std::size_t kDigits = std::size_t{1} << kDigitBits;
constexpr int kIndexBits = 32 - kDigitBits;
static_assert(RaySorter::kMost <= std::size_t{1} << kIndexBits);
// Rays that a thread counts and moves at a time.
constexpr std::size_t kBlock = std::size_t{1} << 14;

using Counts = std::array<std::uint32_t, kDigits>;

struct CoordinateRange {
    float lower = 0;
    float upper = 0;

    double size() const { return double{upper} - lower; }
};

CoordinateRange range_of(std::span<const Coordinates> samples, std::size_t k) {
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

/// A curve over these ranges: each bit of a key halves the cells that are the longest so far.
RayCurve curve_over(std::span<const CoordinateRange> ranges, double extent) {
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

// Bits of all coordinates together: two passes over 2^11 places. RaySorter has threads and keys of
// 16 bits; one sort for both takes more lines than the two.
constexpr std::uint32_t kPassBits = 11;
constexpr std::uint32_t kBits = 2 * kPassBits;

struct Item {
    std::uint32_t key;
    std::uint32_t index;
};

void sort_by_digit(std::span<const Item> from, std::span<Item> to, std::uint32_t shift) {
    constexpr std::uint32_t kMask = (1u << kPassBits) - 1;
    std::vector<std::uint32_t> next(std::size_t{1} << kPassBits);
    for (const Item& item : from) ++next[(item.key >> shift) & kMask];
    std::uint32_t sum = 0;
    for (std::uint32_t& count : next) sum += std::exchange(count, sum);
    for (const Item& item : from) to[next[(item.key >> shift) & kMask]++] = item;
}

}  // namespace

void RaySorter::choose_curve(std::span<const Ray> rays, double extent) {
    assert(!rays.empty());
    std::array<Coordinates, kSamples> samples;
    for (std::size_t i = 0; i < kSamples; ++i)
        samples[i] = mray::cpu::ray_coordinates(stored(rays)[(rays.size() - 1) / kSamples * i]);
    std::array<CoordinateRange, RayCurve::kCoordinates> ranges;
    for (std::size_t k = 0; k < ranges.size(); ++k) ranges[k] = range_of(samples, k);
    curve_ = curve_over(ranges, extent);
}

std::span<const std::uint32_t> RaySorter::sort(std::span<const Ray> rays,
                                               const mray::SimdTarget& target,
                                               mray::ThreadArena* arena) {
    assert(rays.size() <= kMost);
    const std::size_t count = rays.size();
    if (places_.size() < count) {
        keys_.resize(count);
        items_.resize(count);
        places_.resize(count);
    }
    // By the upper digit, in blocks; then each digit's rays by the lower one.
    std::array<Counts, kMost / kBlock> counts;
    const std::size_t blocks = (count + kBlock - 1) / kBlock;
    const auto end_of = [&](std::size_t block) { return std::min((block + 1) * kBlock, count); };
    for_each_index(arena, blocks, [&](std::size_t block) {
        const std::size_t begin = block * kBlock;
        const std::span keys = std::span(keys_).subspan(begin, end_of(block) - begin);
        mray::cpu::find_ray_keys(curve_, target, stored(rays.subspan(begin, keys.size())), keys);
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
    for_each_index(arena, blocks, [&](std::size_t block) {
        Counts& next = counts[block];
        for (std::size_t i = block * kBlock; i < end_of(block); ++i) {
            const std::uint32_t key = keys_[i];
            const auto index = static_cast<std::uint32_t>(i);
            items_[next[key >> kDigitBits]++] = key << kIndexBits | index;
        }
    });
    for_each_index(arena, kDigits, [&](std::size_t digit) {
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

std::vector<std::uint32_t> order_points(std::span<const Vec3> points,
                                        const mray::WorldBounds& scene, PointOrder by) {
    const int axes = by == PointOrder::columns ? 2 : 3;
    constexpr float kMost = std::numeric_limits<float>::max();
    const mray::vec3 least(2.0 * scene.lower - scene.upper);
    const mray::vec3 most(2.0 * scene.upper - scene.lower);
    mray::vec3 lower(kMost);
    mray::vec3 upper(-kMost);
    for (const Vec3& p : points) {
        const mray::vec3 near = glm::clamp(mray::vec3(p.x, p.y, p.z), least, most);
        lower = glm::min(lower, near);
        upper = glm::max(upper, near);
    }
    const auto cells = static_cast<float>(1u << (kBits / static_cast<std::uint32_t>(axes)));
    float scale[3];
    for (int axis = 0; axis < 3; ++axis) {
        const float extent = upper[axis] - lower[axis];
        scale[axis] = extent > 0 && extent <= kMost ? cells / extent : 0;
    }
    std::vector<Item> items(points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
        std::uint32_t cell_of[3] = {};
        const float coordinates[] = {points[i].x, points[i].y, points[i].z};
        for (int axis = 0; axis < axes; ++axis) {
            const float cell = (coordinates[axis] - lower[axis]) * scale[axis];
            // Comparisons that are false for NaN.
            const float clamped = cell >= 0 ? (cell < cells ? cell : cells - 1) : 0;
            cell_of[axis] = static_cast<std::uint32_t>(clamped);
        }
        const auto& [x, y, z] = cell_of;
        const std::uint64_t key =
            axes == 2 ? glm::bitfieldInterleave(x, y) : glm::bitfieldInterleave(x, y, z);
        items[i] = {static_cast<std::uint32_t>(key), static_cast<std::uint32_t>(i)};
    }
    std::vector<Item> sorted(items.size());
    sort_by_digit(items, sorted, 0);
    sort_by_digit(sorted, items, kPassBits);
    std::vector<std::uint32_t> order(items.size());
    for (std::size_t i = 0; i < items.size(); ++i) order[i] = items[i].index;
    return order;
}

std::vector<std::uint32_t> tiled_places(std::size_t width, std::size_t total) {
    constexpr std::size_t kSide = 8;
    const std::size_t height = width < kSide ? 0 : total / width / kSide * kSide;
    std::vector<std::uint32_t> places(total);
    auto next = places.begin();
    for (std::size_t tile = 0; tile < height; tile += kSide)
        for (std::size_t left = 0; left < width; left += kSide)
            for (std::size_t y = tile; y < tile + kSide; ++y)
                for (std::size_t x = left; x < std::min(left + kSide, width); ++x)
                    *next++ = static_cast<std::uint32_t>(y * width + x);
    std::iota(next, places.end(), static_cast<std::uint32_t>(next - places.begin()));
    return places;
}

}  // namespace morphray::detail
