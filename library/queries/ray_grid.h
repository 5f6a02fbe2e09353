// Rays that a caller has made for an image, found among any rays.
#pragma once

#include <cstddef>
#include <span>

#include "morphray/geometry.hpp"

namespace morphray::detail {

/// Part of a sequence of rays that are row by row those of an image with a side of `row` rays.
struct RayGrid {
    std::size_t row = 0;
    std::size_t rows = 0;
};

/// Guesses whether the rays are those of an image, row by row, from one point: whether the first
/// ones go on in one direction and then return. A wrong guess costs time and nothing else, since
/// tiles of the grid are checked when they are traced. Rows of 0 rays: they are not, or are few.
RayGrid find_grid(std::span<const Ray> rays);

/// Orders the rays of a grid that has rows tile after tile, and the rays beside the tiles last.
/// Sets places[i] to the index of the ray that is number begin + i in this order, a permutation.
void find_tiled_places(const RayGrid& grid, std::size_t begin, std::span<std::size_t> places);

}  // namespace morphray::detail
