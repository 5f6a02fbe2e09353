// Directions and axes of views.
#pragma once

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

namespace mray {

using glm::dvec3;

/// The sine of the angle between up and the view below which they count as parallel: far above the
/// rounding of a cross product, far below any angle that is meant.
inline constexpr double kParallel = 1e-9;

inline bool all_finite(const dvec3& v) {
    return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

/// The unit vector in v's direction, or 0 for a vector without one. Any finite length will do.
inline dvec3 direction_of(dvec3 v) {
    const double largest = std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
    if (!(largest > 0) || !std::isfinite(largest)) return {0, 0, 0};
    // First by a power of two, so that no square overflows or vanishes.
    const int exponent = std::ilogb(largest);
    for (int axis = 0; axis < 3; ++axis) v[axis] = std::ldexp(v[axis], -exponent);
    return v / glm::length(v);
}

inline bool valid_fov(double fov) { return fov > 0 && fov < 180; }

/// Right, up and forward of a view, of length 1 and at right angles.
struct Axes {
    dvec3 right;
    dvec3 up;
    dvec3 forward;
};

/// right and up are 0 when up is parallel to the view or has no direction.
inline Axes axes_of(const dvec3& forward, const dvec3& up) {
    const dvec3 across = glm::cross(forward, direction_of(up));
    if (!(glm::length(across) > kParallel)) return {{0, 0, 0}, {0, 0, 0}, forward};
    const dvec3 right = across / glm::length(across);
    return {right, glm::cross(right, forward), forward};
}

}  // namespace mray
