// An image that no encoder can shorten.
#pragma once

#include <cstdint>
#include <random>

#include "common/image/png.h"

namespace mray::test {

/// Random pixels in which `set_bits` are set.
inline Image noise(std::uint32_t width, std::uint32_t height, std::uint32_t set_bits,
                   unsigned seed) {
    std::mt19937 random(seed);
    Image image{width, height, {}};
    for (std::size_t i = 0; i < std::size_t{width} * height; ++i) {
        image.pixels.push_back(static_cast<std::uint32_t>(random()) | set_bits);
    }
    return image;
}

}  // namespace mray::test
