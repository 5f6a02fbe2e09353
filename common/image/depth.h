// Depths of an image's hits.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "common/interop/camera.h"
#include "common/scene/camera_setup.h"
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

/// Depths along the viewing direction in world space: white up to `near`, darkest from near + range
/// on, as in depth_colour() of common/interop/lit.h.
struct DepthRange {
    double near = 0;
    double range = 1;
};

/// From the eye's side of the bounding sphere to the other, or from the eye if it is within. Empty
/// bounds count as a radius of 1 around the eye.
inline DepthRange depth_range(const Point& eye, const WorldBounds& bounds) {
    double distance = 0;
    double radius = 1;
    if (!bounds.empty()) {
        double to_centre[3];
        double half[3];
        for (std::size_t k = 0; k < 3; ++k) {
            to_centre[k] = eye[k] - (bounds.lower[k] / 2 + bounds.upper[k] / 2);
            half[k] = bounds.upper[k] / 2 - bounds.lower[k] / 2;
        }
        distance = std::hypot(to_centre[0], to_centre[1], to_centre[2]);
        radius = std::hypot(half[0], half[1], half[2]);
    }
    const double near = std::max(distance - radius, 0.0);
    return {near, std::max(distance + radius - near, 1e-30)};
}

}  // namespace mray
