// The differences of two files of hits, and of two PNG images.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "common/report/compare.h"

namespace mray::app {

/// Two files of hits.
struct DiffReport {
    std::string expected;
    std::string actual;
    std::uint32_t width = 0;
    std::uint32_t height = 0;
    /// One for each image of both files.
    std::vector<FrameDifference> images;

    std::uint64_t differing_images() const;
    std::uint64_t differing_pixels() const;
    bool equal() const { return differing_images() == 0; }
};

/// Two images.
struct ImageDiffReport {
    std::string expected;
    std::string actual;
    std::uint32_t width = 0;
    std::uint32_t height = 0;
    /// All in `colour`.
    FrameDifference difference;
    /// The largest difference of a channel, actual less expected, and its first pixel.
    struct Channel {
        int by = 0;
        std::uint32_t x = 0;
        std::uint32_t y = 0;
    };
    /// Red, green, blue, alpha.
    std::array<Channel, 4> channels;

    bool equal() const { return difference.total() == 0; }
};
inline constexpr std::array<const char*, 4> kChannelNames = {"red", "green", "blue", "alpha"};
/// "#rrggbbaa".
std::string colour_text(std::uint32_t pixel);

std::string to_json(const DiffReport& report);
std::string to_json(const ImageDiffReport& report);

}  // namespace mray::app
