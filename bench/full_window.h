// Where an image is full.
#pragma once

#include <cstdint>
#include <span>

namespace morphray::bench {

/// A square of pixels of a square image.
struct Window {
    std::uint32_t x;
    std::uint32_t y;
    std::uint32_t side;
    /// Of its pixels that are hits, from 0 to 1.
    double hit_share;
};

/// An image counts as full from this share of hits on: a silhouette leaves some corner out.
inline constexpr double kFullShare = 0.95;
/// A window is at least this part of the image's side: of scenes that are full nowhere, hair or
/// separate triangles, a smaller one would show a few triangles at most.
inline constexpr std::uint32_t kMaxZoom = 8;

/// The largest full window, of several the one nearest to the middle; where none is full, the one
/// with the greatest share, of several the largest. hits: 1 or 0 row by row, side * side of them,
/// side >= kMaxZoom.
Window find_full_window(std::span<const std::uint8_t> hits, std::uint32_t side);

}  // namespace morphray::bench
