// Depths of an image's hits.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>

#include "common/interop/camera.h"
#include "common/scene/scene_space.h"

namespace mray {

/// The depth along the viewing direction, in world space, of a hit of the camera ray of pixel
/// (x, y). A depth too large for a float becomes the largest one.
inline float world_depth(const Camera& camera, const SceneSpace& space, float t, std::uint32_t x,
                         std::uint32_t y) {
    constexpr double kLargest = std::numeric_limits<float>::max();
    const double scale = camera_depth_scale(camera, x, y);
    return static_cast<float>(std::min(space.length_to_world(t * scale), kLargest));
}

}  // namespace mray
