#include "library/src/queries/point_order.h"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <utility>

namespace morphray::detail {
namespace {

// Bits of all coordinates together: two passes over 2^11 places.
constexpr std::uint32_t kPassBits = 11;
constexpr std::uint32_t kBits = 2 * kPassBits;

struct Item {
    std::uint32_t key;
    std::uint32_t index;
};

/// x with a zero between its bits, for x < 2^16.
std::uint32_t spread_by_2(std::uint32_t x) {
    x = (x | (x << 8)) & 0x00FF00FFu;
    x = (x | (x << 4)) & 0x0F0F0F0Fu;
    x = (x | (x << 2)) & 0x33333333u;
    return (x | (x << 1)) & 0x55555555u;
}

/// x with two zeros between its bits, for x < 2^10.
std::uint32_t spread_by_3(std::uint32_t x) {
    x = (x | (x << 16)) & 0x030000FFu;
    x = (x | (x << 8)) & 0x0300F00Fu;
    x = (x | (x << 4)) & 0x030C30C3u;
    return (x | (x << 2)) & 0x09249249u;
}

void sort_by_digit(std::span<const Item> from, std::span<Item> to, std::uint32_t shift) {
    constexpr std::uint32_t kMask = (1u << kPassBits) - 1;
    std::vector<std::uint32_t> next(std::size_t{1} << kPassBits);
    for (const Item& item : from) ++next[(item.key >> shift) & kMask];
    std::uint32_t sum = 0;
    for (std::uint32_t& count : next) sum += std::exchange(count, sum);
    for (const Item& item : from) to[next[(item.key >> shift) & kMask]++] = item;
}

}  // namespace

std::vector<std::uint32_t> order_points(std::span<const mray::vec3> points, PointOrder by) {
    const int axes = by == PointOrder::columns ? 2 : 3;
    constexpr float kMost = std::numeric_limits<float>::max();
    float lower[3] = {kMost, kMost, kMost};
    float upper[3] = {-kMost, -kMost, -kMost};
    for (const mray::vec3& p : points) {
        for (int axis = 0; axis < 3; ++axis) {
            lower[axis] = std::min(lower[axis], p[axis]);
            upper[axis] = std::max(upper[axis], p[axis]);
        }
    }
    const auto cells = static_cast<float>(1u << (kBits / static_cast<std::uint32_t>(axes)));
    float scale[3];
    for (int axis = 0; axis < 3; ++axis) {
        const float extent = upper[axis] - lower[axis];
        scale[axis] = extent > 0 && extent <= kMost ? cells / extent : 0;
    }
    std::vector<Item> items(points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
        std::uint32_t key = 0;
        for (int axis = 0; axis < axes; ++axis) {
            const float cell = (points[i][axis] - lower[axis]) * scale[axis];
            // Comparisons that are false for NaN.
            const float clamped = cell >= 0 ? (cell < cells ? cell : cells - 1) : 0;
            const auto number = static_cast<std::uint32_t>(clamped);
            key |= (axes == 2 ? spread_by_2(number) : spread_by_3(number)) << axis;
        }
        items[i] = {key, static_cast<std::uint32_t>(i)};
    }
    std::vector<Item> sorted(items.size());
    sort_by_digit(items, sorted, 0);
    sort_by_digit(sorted, items, kPassBits);
    std::vector<std::uint32_t> order(items.size());
    for (std::size_t i = 0; i < items.size(); ++i) order[i] = items[i].index;
    return order;
}

}  // namespace morphray::detail
