// The part of a scene that the image shows.
#pragma once

#include <cstdint>
#include <span>

#include "common/bvh/bvh.h"
#include "common/scene/camera_setup.h"
#include "common/scene/scene_space.h"

namespace mray::bench {

/// kWhole is the default camera, which keeps the whole clip in the image. kFill looks from the
/// same eye, by the same light, at the part of that image which is full, so that (nearly) every
/// pixel sees the scene. kInside is kFill in a scene that is closed: the eye and the light are in
/// it.
enum class ViewKind { kFill, kWhole, kInside };

/// "fill", "whole" or "inside"
const char* name_of(ViewKind kind);

/// The view of kFill: `whole` with eye, target, fov and light set. `bvh` is the tree of the scene,
/// which decides which part of the image is full.
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
