// Rectangles of pixels.
#pragma once

#include <cstdint>

namespace morphray::cpu {

/// Pixels [x0, x1) x [y0, y1).
struct Tile {
    std::uint32_t x0, y0, x1, y1;
};

}  // namespace morphray::cpu
