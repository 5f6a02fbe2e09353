#include "common/scene/world_bounds.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

namespace mray {
namespace {

constexpr std::size_t kBlock = 1024;
/// Four points at a time, so that the compiler makes vectors of twelve floats.
constexpr std::size_t kLanes = 12;
static_assert(3 * kBlock % kLanes == 0);

/// Extends the bounds by a block of finite points; returns false, and does nothing, if one is not
/// finite.
bool extend_by_block(std::span<const vec3> block, WorldBounds& bounds) {
    const float* const numbers = &block[0].x;
    std::array<float, kLanes> lower;
    std::array<float, kLanes> upper;
    std::array<std::uint32_t, kLanes> is_bad = {};
    std::copy_n(numbers, kLanes, lower.begin());
    std::copy_n(numbers, kLanes, upper.begin());
    for (std::size_t i = 0; i < 3 * block.size(); i += kLanes) {
        for (std::size_t lane = 0; lane < kLanes; ++lane) {
            const float x = numbers[i + lane];
            lower[lane] = std::min(lower[lane], x);
            upper[lane] = std::max(upper[lane], x);
            is_bad[lane] |= std::uint32_t{!(std::abs(x) <= std::numeric_limits<float>::max())};
        }
    }
    if (std::any_of(is_bad.begin(), is_bad.end(), [](std::uint32_t bad) { return bad != 0; }))
        return false;
    for (std::size_t lane = 0; lane < kLanes; lane += 3) {
        const double low[3] = {lower[lane], lower[lane + 1], lower[lane + 2]};
        const double high[3] = {upper[lane], upper[lane + 1], upper[lane + 2]};
        bounds.extend(low, high);
    }
    return true;
}

}  // namespace

void WorldBounds::extend(const double other_lower[3], const double other_upper[3]) {
    const bool was_empty = empty();
    for (int axis = 0; axis < 3; ++axis) {
        lower[axis] = was_empty ? other_lower[axis] : std::min(lower[axis], other_lower[axis]);
        upper[axis] = was_empty ? other_upper[axis] : std::max(upper[axis], other_upper[axis]);
    }
}

WorldBounds bounds_of(std::span<const vec3> points) {
    WorldBounds bounds;
    for (; !points.empty(); points = points.subspan(std::min(kBlock, points.size()))) {
        if (points.size() >= kBlock && extend_by_block(points.first(kBlock), bounds)) continue;
        for (const vec3 p : points.first(std::min(kBlock, points.size()))) {
            if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) continue;
            const double point[3] = {p.x, p.y, p.z};
            bounds.extend(point, point);
        }
    }
    return bounds;
}

}  // namespace mray
