// The colours of costs.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <iterator>

#include "common/interop/shading.h"

namespace mray {

/// A colour from dark blue over green to dark red (after A. Mikhailov. Turbo, an improved rainbow
/// colormap for visualization. 2019), in proportion to the logarithm of n: from 2^first to 2^last.
inline std::uint32_t heat_colour(std::uint32_t n, std::uint32_t first, std::uint32_t last) {
    // Red, green and blue at equal distances.
    static constexpr std::int32_t kStops[][3] = {{48, 18, 59},   {70, 134, 251}, {27, 229, 181},
                                                 {164, 252, 60}, {251, 185, 56}, {226, 66, 10},
                                                 {122, 4, 3}};
    constexpr std::int32_t kParts = std::size(kStops) - 1;
    // The logarithm in units of 2^-8, linear between powers of two.
    const std::uint32_t from = std::clamp(n, 1u << first, 1u << last);
    const auto power = static_cast<std::uint32_t>(std::bit_width(from)) - 1;
    const auto fraction = static_cast<std::uint32_t>((std::uint64_t{from} << 8 >> power) & 255);
    const auto range = static_cast<std::int32_t>((last - first) << 8);
    const auto along = static_cast<std::int32_t>(((power - first) << 8) + fraction) * kParts;
    const std::int32_t part = std::min(along / range, kParts - 1);
    const std::int32_t rest = along - part * range;
    std::uint32_t channels[3];
    for (int k = 0; k < 3; ++k) {
        const std::int32_t a = kStops[part][k];
        const std::int32_t b = kStops[part + 1][k];
        channels[k] = static_cast<std::uint32_t>(a + (b - a) * rest / range);
    }
    return pack_rgb(channels[0], channels[1], channels[2]);
}

/// heat_colour() of a number of steps, from 1 to 64, and of a looseness, from 1 to 16.
inline std::uint32_t steps_colour(std::uint32_t steps) { return heat_colour(steps, 0, 6); }
inline std::uint32_t looseness_colour(float looseness) {
    return heat_colour(static_cast<std::uint32_t>(std::min(looseness, 1024.0f) * 16.0f), 4, 8);
}

}  // namespace mray
