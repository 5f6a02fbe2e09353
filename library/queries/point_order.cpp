#include "library/queries/point_order.h"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <utility>

namespace morphray::detail {
namespace {

// Bits of each coordinate, so that two passes over 2^11 places sort by all of them.
constexpr std::uint32_t kBits = 7;
constexpr std::uint32_t kDigitBits = 11;

struct Item {
    std::uint32_t key;
    std::uint32_t index;
};

/// x with two zeros between its bits, for x < 2^10.
std::uint32_t spread(std::uint32_t x) {
    x = (x | (x << 16)) & 0x030000FFu;
    x = (x | (x << 8)) & 0x0300F00Fu;
    x = (x | (x << 4)) & 0x030C30C3u;
    return (x | (x << 2)) & 0x09249249u;
}

void sort_by_digit(std::span<const Item> from, std::span<Item> to, std::uint32_t shift) {
    constexpr std::uint32_t kMask = (1u << kDigitBits) - 1;
    std::vector<std::uint32_t> next(std::size_t{1} << kDigitBits);
    for (const Item& item : from) ++next[(item.key >> shift) & kMask];
    std::uint32_t sum = 0;
    for (std::uint32_t& count : next) sum += std::exchange(count, sum);
    for (const Item& item : from) to[next[(item.key >> shift) & kMask]++] = item;
}

}  // namespace

std::vector<std::uint32_t> order_points(std::span<const mray::vec3> points) {
    constexpr float kMost = std::numeric_limits<float>::max();
    float lower[3] = {kMost, kMost, kMost};
    float upper[3] = {-kMost, -kMost, -kMost};
    for (const mray::vec3& p : points) {
        for (int axis = 0; axis < 3; ++axis) {
            lower[axis] = std::min(lower[axis], p[axis]);
            upper[axis] = std::max(upper[axis], p[axis]);
        }
    }
    constexpr float kCells = 1u << kBits;
    float scale[3];
    for (int axis = 0; axis < 3; ++axis) {
        const float extent = upper[axis] - lower[axis];
        scale[axis] = extent > 0 && extent <= kMost ? kCells / extent : 0;
    }
    std::vector<Item> items(points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
        std::uint32_t key = 0;
        for (int axis = 0; axis < 3; ++axis) {
            const float cell = (points[i][axis] - lower[axis]) * scale[axis];
            // Comparisons that are false for NaN.
            const float clamped = cell >= 0 ? (cell < kCells ? cell : kCells - 1) : 0;
            key |= spread(static_cast<std::uint32_t>(clamped)) << axis;
        }
        items[i] = {key, static_cast<std::uint32_t>(i)};
    }
    std::vector<Item> sorted(items.size());
    sort_by_digit(items, sorted, 0);
    sort_by_digit(sorted, items, kDigitBits);
    std::vector<std::uint32_t> order(items.size());
    for (std::size_t i = 0; i < items.size(); ++i) order[i] = items[i].index;
    return order;
}

}  // namespace morphray::detail
