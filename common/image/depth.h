// Depths of an image's hits.
#pragma once

#include <algorithm>
#include <limits>

#include <glm/geometric.hpp>

#include "common/interop/camera.h"
#include "common/scene/camera_setup.h"
#include "common/scene/scene_space.h"

namespace mray {

/// The depth along the viewing direction, in world space, of a hit of the camera ray of pixel
/// (x, y); at most the largest float.
inline float world_depth(const Camera& camera, const SceneSpace& space, float t, std::uint32_t x,
                         std::uint32_t y) {
    constexpr double kLargest = std::numeric_limits<float>::max();
    const double scale = camera_depth_scale(camera, x, y);
    return static_cast<float>(std::min(space.length_to_world(t * scale), kLargest));
}

/// Depths in world space: white up to `near`, darkest from near + range on (depth_colour()).
struct DepthRange {
    double near = 0;
    double range = 1;
};

/// From the nearest corner of the bounds, or the eye, to the farthest; of empty bounds 0 to 1.
inline DepthRange depth_range(const Point& eye, const Point& target, const WorldBounds& bounds) {
    if (bounds.empty()) return {};
    const glm::dvec3 forward = glm::normalize(to_dvec3(target) - to_dvec3(eye));
    double near = std::numeric_limits<double>::infinity();
    double far = 0;
    for (unsigned i = 0; i < 8; ++i) {
        const glm::dvec3 corner((i & 1 ? bounds.upper : bounds.lower)[0],
                                (i & 2 ? bounds.upper : bounds.lower)[1],
                                (i & 4 ? bounds.upper : bounds.lower)[2]);
        const double depth = glm::dot(corner - to_dvec3(eye), forward);
        near = std::min(near, depth);
        far = std::max(far, depth);
    }
    near = std::clamp(near, 0.0, far);
    // A flat scene that is seen at right angles has one depth.
    return {near, std::max({far - near, 0x1p-10 * far, 1e-30})};
}

}  // namespace mray
