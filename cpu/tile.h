// Rectangles of pixels.
#pragma once

#include <algorithm>
#include <cstdint>

namespace mray::cpu {

/// Pixels [x0, x1) x [y0, y1).
struct Tile {
    std::uint32_t x0, y0, x1, y1;
};

/// An image in tiles of side x side pixels, row by row; the last of a row or column may be
/// smaller.
class ImageTiles {
public:
    ImageTiles(std::uint32_t width, std::uint32_t height, std::uint32_t side)
        : width_(width), height_(height), side_(side), columns_((width + side - 1) / side) {}

    std::uint32_t count() const { return columns_ * ((height_ + side_ - 1) / side_); }
    Tile operator[](std::uint32_t i) const {
        const std::uint32_t x = i % columns_ * side_;
        const std::uint32_t y = i / columns_ * side_;
        return {x, y, std::min(x + side_, width_), std::min(y + side_, height_)};
    }

private:
    std::uint32_t width_, height_, side_, columns_;
};

}  // namespace mray::cpu
