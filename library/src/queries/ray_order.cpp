#include "library/src/queries/ray_order.h"

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

std::span<const mray::StoredRay> stored(std::span<const Ray> rays) {
    static_assert(sizeof(Ray) == sizeof(mray::StoredRay));
    return {reinterpret_cast<const mray::StoredRay*>(rays.data()), rays.size()};
}

struct Range {
    float lower = 0;
    float upper = 0;

    double size() const { return double{upper} - lower; }
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

void find_tiled_places(std::size_t width, std::size_t total, std::size_t begin,
                       std::span<std::size_t> places) {
    const std::size_t band_size = kTileSide * width;
    const std::size_t tiled = total / width / kTileSide * band_size;
    std::size_t filled = 0;
    while (filled < places.size() && begin + filled < tiled) {
        // The rest of a tile. Columns beside the tiles are a narrower one.
        const std::size_t in_band = (begin + filled) % band_size;
        const std::size_t x = in_band / (kTileSide * kTileSide) * kTileSide;
        const std::size_t tile_width = std::min(kTileSide, width - x);
        const std::size_t in_tile = in_band - x * kTileSide;
        const std::size_t corner = begin + filled - in_band + x;
        std::size_t column = in_tile % tile_width;
        for (std::size_t y = in_tile / tile_width; y < kTileSide && filled < places.size(); ++y) {
            for (; column < tile_width && filled < places.size(); ++column)
                places[filled++] = corner + y * width + column;
            column = 0;
        }
    }
    for (; filled < places.size(); ++filled) places[filled] = begin + filled;
}

RayCurve curve_of(std::span<const Ray> rays, double extent) {
    assert(!rays.empty());
    std::array<Coordinates, kSamples> samples;
    for (std::size_t i = 0; i < kSamples; ++i)
        samples[i] = mray::cpu::ray_coordinates(stored(rays)[(rays.size() - 1) / kSamples * i]);
    std::array<Range, RayCurve::kCoordinates> ranges;
    for (std::size_t k = 0; k < ranges.size(); ++k) ranges[k] = range_of(samples, k);
    return curve_over(ranges, extent);
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
