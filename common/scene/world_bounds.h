// Boxes in world space.
#pragma once

#include <span>

#include "common/scene/mesh.h"

namespace mray {

/// Lower and upper corner of a set of points in world space, in double so that no extent of
/// floats overflows. Without a finite point they are empty: lower > upper.
struct WorldBounds {
    double lower[3] = {1, 1, 1};
    double upper[3] = {-1, -1, -1};
    bool empty() const { return lower[0] > upper[0]; }

    /// Extends the bounds by a box that is not empty.
    void extend(const double other_lower[3], const double other_upper[3]);
};

/// The bounds of the finite points.
WorldBounds bounds_of(std::span<const vec3> points);

}  // namespace mray
