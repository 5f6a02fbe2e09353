// Compares two frames that should be equal, bit by bit.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "common/image/frame.h"

namespace mray {

struct PixelDifference {
    std::uint32_t x = 0;
    std::uint32_t y = 0;
    Hit expected;
    Hit actual;
    std::uint32_t expected_occlusion = 0;
    std::uint32_t actual_occlusion = 0;
    std::uint32_t expected_pixel = 0;
    std::uint32_t actual_pixel = 0;
};

/// Counts of differing pixels. A pixel counts once, for the first of these that differs.
struct FrameDifference {
    std::uint64_t false_miss = 0;  // expected hits, actual does not
    std::uint64_t false_hit = 0;   // actual hits, expected does not
    std::uint64_t prim_id = 0;
    std::uint64_t t = 0;
    std::uint64_t uv = 0;
    std::uint64_t occlusion = 0;
    std::uint64_t colour = 0;
    /// The first differing pixels, row by row, at most `keep` of them.
    std::vector<PixelDifference> first;

    std::uint64_t total() const {
        return false_miss + false_hit + prim_id + t + uv + occlusion + colour;
    }
};

/// Compares floats as bits. Both frames have the same size (asserted).
FrameDifference compare_frames(const Frame& expected, const Frame& actual, std::size_t keep = 10);

/// Every bit, such as "t 0x1.8p+0 u 0x1p-2 v 0x1p-1 prim 7", or "miss".
std::string describe(const Hit& hit);

/// "12 pixels differ: 3 false misses, 9 prim_id" or "equal".
std::string describe(const FrameDifference& difference);

}  // namespace mray
