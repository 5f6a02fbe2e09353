// The part of a scene that the image shows.
#pragma once

#include <cstdint>
#include <span>

#include "common/bvh/bvh.h"
#include "common/scene/camera_setup.h"
#include "common/scene/scene_space.h"

namespace mray::bench {

/// `whole` with eye, target, fov and light set: from the default eye and by the default light, at
/// the part of the image which is full, so that (nearly) every pixel sees the scene. `bvh` is the
/// tree of the scene, which decides which part that is.
ViewSpec fill_view(const ViewSpec& whole, const WorldBounds& bounds, const SceneSpace& space,
                   const Bvh& bvh);

/// A square of pixels of a square image.
struct Window {
    std::uint32_t x;
    std::uint32_t y;
    std::uint32_t side;
    /// The share of its pixels that are hits, from 0 to 1.
    double hit_share;
};

/// A window counts as full from this share of hits on, because a silhouette leaves out some corner.
inline constexpr double kFullShare = 0.95;
/// A window's side is at least the image's side divided by this. In scenes that are full nowhere,
/// such as hair or separate triangles, a smaller one would show only a few triangles.
inline constexpr std::uint32_t kMaxZoom = 8;

/// The largest full window, of several the one nearest to the middle; if none is full, the one with
/// the greatest share, of several the largest. `hits` is 1 or 0 for each pixel, row by row, side *
/// side of them, side >= kMaxZoom.
Window find_full_window(std::span<const std::uint8_t> hits, std::uint32_t side);

}  // namespace mray::bench
